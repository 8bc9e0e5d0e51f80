"""Sweeps run on a Dask cluster of two workers; they are stopped and continued, and a worker dies during a
sweep."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from submissions import SUBMISSIONS

from lessons.cluster import on_cluster
from lessons.parallel import FailedJob
from robots import InputError

distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")

pytestmark = pytest.mark.nightly("lessons/cluster.py", "lessons/parallel.py")
ROOT = Path(__file__).parents[2]
CELLS = 8


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A scheduler with two worker processes; an item that kills two workers is not tried again. With the
    usual time limit of 15 s, a worker that is still missing after another one has died would not be started
    again."""
    from dask.config import set as configured

    with (
        configured(
            {
                "distributed.scheduler.allowed-failures": 1,
                "distributed.deploy.lost-worker-timeout": "1h",
            }
        ),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, protocol="tcp"
        ) as found,
    ):
        yield found


def until(condition: Callable[[], bool], what: str) -> None:
    """Waits for a condition, and fails after two minutes."""
    deadline = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


def lines(folder: Path) -> int:
    file = folder / "cells.jsonl"
    return file.read_bytes().count(b"\n") if file.exists() else 0


def begin(out: Path, *more: str) -> subprocess.Popen[bytes]:
    """Starts `himpc-lab sweep` over δ, on the square of the mobile manipulator, as a separate program."""
    what = [
        "ridgeback-ur10-square",
        "--over",
        f"delta_m=0.002:0.05:{CELLS}",
        "--duration",
        "8",
        "--out",
        str(out),
    ]
    command = [sys.executable, "-m", "app", "sweep", *what, *more]
    return subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL
    )


def test_a_sweep_of_htmpc_survives_a_kill_and_a_dead_worker(cluster: Any, tmp_path: Path) -> None:
    """A sweep is killed after its first cell and continued, and one worker is killed meanwhile. The results
    equal those on local cores, and no cell is lost or computed twice."""
    local, out = tmp_path / "local", tmp_path / "cluster"
    scheduler = ("--scheduler", cluster.scheduler_address)
    assert begin(local).wait(300) == 0

    first = begin(out, *scheduler)
    until(lambda: lines(out) > 0, "no cell was finished")
    first.kill()
    first.wait(60)
    held = lines(out)
    assert 0 < held < CELLS

    second = begin(out, *scheduler)
    until(lambda: lines(out) > held or second.poll() is not None, "the sweep does not go on")
    os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
    assert second.wait(300) == 0
    assert lines(out) == CELLS
    assert (out / "results.json").read_bytes() == (local / "results.json").read_bytes()
    cells = json.loads((out / "results.json").read_text())["cells"]
    assert [cell["error"] for cell in cells] == [None] * CELLS
    assert len({cell["at"]["delta_m"] for cell in cells}) == CELLS
    assert (out / "map.png").exists()


def test_a_worker_that_dies_costs_its_item_a_retry(cluster: Any, tmp_path: Path) -> None:
    """If one worker dies, another worker computes its item. If workers die repeatedly with the same item,
    this item fails and the other items succeed."""
    with on_cluster(cluster.scheduler_address) as spread:
        items = [(tmp_path / "once", value) for value in range(6)]
        assert dict(spread(_dies_once, items)) == {value: value for value in range(6)}
        outcomes = dict(spread(_dies_at_one, list(range(4))))
    assert [outcomes[value] for value in (0, 2, 3)] == [0, 2, 3]
    assert isinstance(outcomes[1], FailedJob)


def _dies_once(item: tuple[Path, int]) -> int:
    marker, value = item
    if value == 1 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return value


def _dies_at_one(value: int) -> int:
    if value == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return value


@pytest.fixture
def deserted() -> Iterator[Any]:
    """A scheduler that has no workers."""
    with distributed.LocalCluster(
        n_workers=0, processes=False, dashboard_address=None, protocol="tcp"
    ) as found:
        yield found


def test_a_cluster_without_workers_is_not_waited_for(deserted: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lessons.cluster.WORKER_TIMEOUT_S", 1.0)
    with (
        pytest.raises(InputError, match=f"no worker for 1 s.*dask worker {deserted.scheduler_address}"),
        on_cluster(deserted.scheduler_address) as spread,
    ):
        list(spread(abs, [-1, -2]))


def test_a_scheduler_that_goes_away_is_one_sentence(deserted: Any) -> None:
    going = threading.Timer(0.5, deserted.close)
    with (
        pytest.raises(InputError, match="the scheduler no longer answers"),
        on_cluster(deserted.scheduler_address) as spread,
    ):
        going.start()
        list(spread(abs, [-1, -2]))
    going.join()


def test_a_folder_of_submissions_is_graded_on_the_cluster(cluster: Any, tmp_path: Path) -> None:
    held = tmp_path / "held"
    held.mkdir()
    for name in ("right_time_delay", "wrong_leaves", "wrong_syntax"):
        (held / f"{name}.py").write_text(SUBMISSIONS[name].file)
    tables = []
    for more in ((), ("--scheduler", cluster.scheduler_address)):
        out = tmp_path / f"{len(more)}.csv"
        command = [sys.executable, "-m", "app", "grade", str(held), "--out", str(out), *more]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        assert subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL).returncode == 0
        tables.append(out.read_text())
    assert tables[0] == tables[1]
    assert [line.split(",")[2] for line in tables[0].splitlines()] == ["points", "10", "0", "0"]
