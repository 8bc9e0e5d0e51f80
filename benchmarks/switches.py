"""Does the server's memory stay where it is over many changes of scene, with and without a ghost?

    python -m benchmarks.switches [--switches K] [--warm-up K]

Starts the real server with a client that draws nothing (benchmarks/client.py) and changes the scene again and
again; every fourth scene gets a ghost, which the next change takes along. Prints JSON: the server's memory
after the warm-up and at the end, its processes, its blocks of shared memory, and what viser keeps; exit 0 if
memory grew by less than 10 % and nothing was left behind.
"""

from __future__ import annotations

import argparse
import gc
import json
import subprocess
import sys
import time

import psutil

from app.client.learner import Learner
from app.client.simulation import Simulation
from app.link.choice import SceneChoice
from app.link.messages import Load
from app.link.process import wait_until
from app.server.server import PageServer
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost

SCENES = ("planar3-hold", "iiwa14-hold", "planar3-circle", "panda-hold")
LONG = 120.0  # s
GROWTH = 1.1


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--switches", type=int, default=50)
    parser.add_argument("--warm-up", type=int, default=8)
    options = parser.parse_args()
    server = PageServer(SceneChoice(RunSpec(SCENES[-1])), port=0, max_sessions=1)
    client = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.client", server.link], stdout=subprocess.DEVNULL
    )
    try:
        assert wait_until(lambda: bool(server.sessions.learners), LONG), "the client was not let in"
        learner = server.sessions.learners[0]
        assert wait_until(lambda: runs(learner), LONG), "nothing runs"
        for count in range(options.warm_up):
            switch(learner, count)
        before = state(server)
        for count in range(options.switches):
            switch(learner, count)
        after = state(server)
    finally:
        client.kill()
        client.wait()
        server.close()
    print(json.dumps({"switches": options.switches, "after warm-up": before, "at the end": after}, indent=1))
    same = all(after[name] <= before[name] for name in ("processes", "blocks", "nodes", "controls"))
    return 0 if same and after["megabytes"] < GROWTH * before["megabytes"] else 1


def switch(learner: Learner, count: int) -> None:
    """To the next scene; what was started for the one before is gone, taken along or left out."""
    if count % 4 == 0:
        learner.start_ghost(Ghost("N = 1", ("horizon=1",)))
        assert wait_until(lambda: learner.ghost is not None and runs(learner.ghost), LONG), "no ghost"
    changed = learner.changed
    learner.send(Load(SceneChoice(RunSpec(SCENES[count % len(SCENES)]))))
    assert wait_until(lambda: learner.changed > changed and runs(learner), LONG), "no scene"
    if count % 4 == 1:
        learner.stop_ghost()


def runs(learner: Simulation) -> bool:
    """Whether half a simulated second of the scene has passed."""
    found = learner.read(lambda block, _: block.moment()[0])
    return found is not None and found > 0.5


def state(server: PageServer) -> dict[str, float]:
    """What the server holds on to, once it had a moment to let go."""
    time.sleep(4.0)
    gc.collect()
    process = psutil.Process()
    (viewer,) = server._viser.get_clients().values()
    return {
        "megabytes": round(1e-6 * process.memory_info().rss, 1),
        "processes": len(process.children()),
        "blocks": sum("psm_" in each.path for each in process.memory_maps()),
        "nodes": len(viewer.scene._handle_from_node_name),
        "controls": len(viewer.gui._gui_input_handle_from_uuid),
    }


if __name__ == "__main__":
    sys.exit(main())
