"""Runs `himpc-lab arm` with franka-sim, which uses the network protocol of a Franka arm.

    python3 -m venv SIM && SIM/bin/pip install numpy==1.26.4 "mujoco<3.3" "trimesh>=4"
    SIM/bin/pip install --no-deps franka-sim==1.1.7
    python -m benchmarks.franka --simulator SIM/bin/python

franka-sim has an environment of its own, because it needs an older MuJoCo and NumPy than himpc-lab;
without the package robot_descriptions, franka-sim cannot download anything. Both sides run in a network
namespace of their own that has only a loopback interface (`unshare`, `ip`). The robot is our own panda,
without friction; franka-sim enforces its limits on communication and motion. The run that drives the
arm from a page needs Chromium; `--picture FILE` stores a picture of that page.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import psutil
from numpy.typing import NDArray
from playwright.sync_api import Page, expect, sync_playwright

from app.arm.drive import hurry
from benchmarks import __file__ as HERE
from browsing.browser_actions import (
    CHROMIUM_ARGS,
    eventually,
    find_chromium,
    is_drawn,
    open_page,
    position,
    press,
    set_number,
)
from robots import Robot, load_robot
from robots.settings import PlantSettings
from robots.truth import inertial, joint_axis, pose, true_model

PORT = 1337
INSIDE = "HIMPC_LAB_FRANKA_BENCHMARK"
_PRIORITY = 40
"""Real-time priority of franka-sim, if it is allowed. It is lower than the loop's."""


def model_of(robot: Robot) -> str:
    """Returns the robot for MuJoCo as XML, without friction and with the names that franka-sim looks for."""
    truth = true_model(robot, PlantSettings())
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    bodies = [spec.worldbody]
    for joint in range(1, truth.njoints):
        placed = pose(truth.jointPlacements[joint])
        body = bodies[truth.parents[joint]].add_body(name=f"link{joint}", **placed)
        bodies.append(body)
        body.mass, body.ipos, body.fullinertia = inertial(truth.inertias[joint])
        body.explicitinertial = True
        _, axis = joint_axis(truth, joint)
        body.add_joint(name=f"joint{joint}", axis=axis, armature=truth.armature[joint - 1])
    spec.compile()
    return spec.to_xml()


def urdf_of(robot: Robot) -> str:
    """Returns the robot's URDF with the elements that libfranka requires."""
    root = ET.fromstring(robot.urdf_text)
    for joint in root.iter("joint"):
        if joint.get("type") == "revolute":
            given = {"deceleration_limit": "5.0", "velocity_offset": "0.2"}
            ET.SubElement(joint, "position_based_velocity_limits", given)
    return ET.tostring(root, encoding="unicode")


@contextmanager
def arm(python: str, clock: str, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Runs franka-sim, and yields it as soon as it accepts connections."""
    robot = load_robot("panda")
    (folder / "panda.xml").write_text(model_of(robot))
    (folder / "panda.urdf").write_text(urdf_of(robot))
    numbers = [",".join(map(str, each.tolist())) for each in (robot.M_bar, robot.home)]
    script = Path(HERE).parent / "franka_server.py"
    command = [python, script, folder / "panda.xml", folder / "panda.urdf", *numbers, clock]
    server = subprocess.Popen(command, preexec_fn=partial(hurry, _PRIORITY))
    try:
        for _ in range(200):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", PORT)) == 0:
                    break
            time.sleep(0.1)
        time.sleep(1.0)  # franka-sim still treats the probe as a client
        yield server
    finally:
        server.kill()
        server.wait()


def drive(
    name: str, folder: Path, more: list[str], meanwhile: Callable[[subprocess.Popen[bytes]], None]
) -> None:
    """Runs the command, and prints a summary of its rows."""
    path = folder / f"{name}.npz"
    command = [sys.executable, "-m", "app", "arm", "panda-hold", "--robot", "127.0.0.1", "--npz", path]
    print(f"\n== {name}: {' '.join(more)}", flush=True)
    client = subprocess.Popen([*command, *more])
    meanwhile(client)
    tell(name, path, client.wait())


def tell(name: str, path: Path, code: int) -> None:
    """Prints a summary of the rows of a drive."""
    if not path.exists():
        print(f"{name}: exit code {code}, no rows")
        return
    with np.load(path) as data:
        running = data["ending"] == 0
        away = np.abs(data["q"] - data["q_model"])[running]
        error = np.linalg.norm(data["error/position"][running][-200:], axis=1)
        missed, v, us = data["missed"], np.abs(data["v"][-1]).max(), data["us"]
        print(
            f"{name}: exit code {code}, {running.sum()} periods, {int(missed.sum())} missed, at most "
            f"{int(missed.max(initial=0))} in a row; at most {away.max():.4f} rad from the model; "
            f"hand {1e3 * error.max():.2f} mm from its target in the last 0.2 s; "
            f"largest torque {np.abs(data['tau']).max():.2f} N m, changes {change(data['tau']):.3f} N m; "
            f"at the end {np.abs(data['tau'][-1]).max():.3f} N m, {v:.4f} rad/s; "
            f"controller {np.median(us):.0f} us, longest {us.max():.0f} us",
            flush=True,
        )


def change(tau: NDArray[np.float64]) -> float:
    return float(np.abs(np.diff(tau, axis=0)).max(initial=0.0))


def children(client: subprocess.Popen[bytes]) -> list[psutil.Process]:
    return psutil.Process(client.pid).children()


def nothing(client: subprocess.Popen[bytes]) -> None:
    """Does nothing: the command ends by itself."""


def wait_for_loop(client: subprocess.Popen[bytes]) -> None:
    while client.poll() is None and not children(client):
        time.sleep(0.02)
    time.sleep(2.0)


def kill_loop(client: subprocess.Popen[bytes]) -> None:
    wait_for_loop(client)
    for each in children(client):
        each.kill()


def kill_watcher(client: subprocess.Popen[bytes]) -> None:
    wait_for_loop(client)
    left = children(client)
    client.kill()
    gone, alive = psutil.wait_procs(left, timeout=5.0)
    print(f"killed watcher: {len(gone)} loops ended by themselves, {len(alive)} did not")


def drive_on_a_page(folder: Path, picture: str | None) -> None:
    """Drives the arm from a page in Chromium: presses Run, moves a target by 8 cm, and closes the page."""
    path = folder / "page.npz"
    command = [sys.executable, "-m", "app", "arm", "panda-hold", "--robot", "127.0.0.1", "--missed", "20"]
    command += ["--page", "--no-browser", "--port", "0", "--npz", str(path)]
    print("\n== on a page", flush=True)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client, sync_playwright() as started:
        assert client.stdout is not None
        link = next(line for line in client.stdout if "ready at" in line).split()[-1]
        browser = started.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
        page = open_page(browser, link, 1440, 900, scale=1.0)
        press(page, "Run")
        expect(page.get_by_text("ARM RUNNING")).to_be_visible()
        drawn = eventually(page, lambda: is_drawn(page, "/ghost/1"))
        page.get_by_text("Move a target by keys").click()
        set_number(page, "Target y [m]", 0.08)
        came = eventually(page, lambda: bool(np.allclose(sides(page), 0.08, atol=2e-3)))
        page.wait_for_timeout(2000)
        print(
            f"on a page: ghost {'drawn' if drawn else 'missing'}, target {'reached' if came else 'missed'}; "
        )
        print("y of hand and ghost: {:.4f} m, {:.4f} m".format(*sides(page)))
        if picture is not None:
            page.screenshot(path=picture)
        browser.close()
        for line in client.stdout:
            print(line, end="")
        tell("on a page", path, client.wait())


def sides(page: Page) -> tuple[float, float]:
    """Returns the coordinates y, m, of the hand and of its ghost as the page draws them."""
    return position(page, "/actual")[1], position(page, "/ghost/7")[1]


def inside(python: str, picture: str | None) -> None:
    """Does all runs, inside the namespace."""
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    hold = ["--missed", "20", "--duration", "10"]
    drag = [*hold, "--drag", "2:position=0.05,0,0.05"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with arm(python, "step", folder) as server:
            drive("hold", folder, hold, nothing)
            drive("drag", folder, drag, nothing)
            drive("killed loop", folder, hold, kill_loop)
            time.sleep(1.0)
            drive("killed watcher", folder, hold, kill_watcher)
            time.sleep(1.0)
            drive("again", folder, drag, nothing)
            time.sleep(1.0)
            drive_on_a_page(folder, picture)

            def cut(client: subprocess.Popen[bytes]) -> None:
                wait_for_loop(client)
                server.kill()

            drive("lost connection", folder, hold, cut)
        for delay in ("0", "1", "2", "3"):
            with arm(python, "own", folder):
                drive(f"own clock, delay {delay}", folder, [*drag, "--delay", delay], nothing)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--simulator", required=True, help="Python of the environment with franka-sim")
    parser.add_argument("--picture", help="file for a picture of the page")
    given = parser.parse_args()
    if os.environ.get(INSIDE) != "1":
        # Root stays root and may use real-time priorities; others become root of their namespace only.
        alone = ["unshare", "-n" if os.geteuid() == 0 else "-rn"]
        command = [*alone, sys.executable, "-m", "benchmarks.franka", *sys.argv[1:]]
        sys.exit(subprocess.run(command, env={**os.environ, INSIDE: "1"}).returncode)
    inside(str(Path(given.simulator).absolute()), given.picture)


if __name__ == "__main__":
    main()
