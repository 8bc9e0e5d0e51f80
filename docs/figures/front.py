"""Writes the live figures beside the built pages: the program of docs/browser/, MuJoCo, the kernel, the data.

Without Node, npm or a linker for WebAssembly, the site has no live figures and states this.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco

from docs.figures.pack import Pack, without_names, wrapped
from docs.figures.robot import robot_script
from docs.figures.scene import scene_data
from docs.figures.steps import lesson_script, robots_of
from himpc.export.layout import layout_number
from himpc.export.link import check_linker, linked
from himpc.export.objects import object_code, target_named
from lessons.course import COURSE, load_lesson
from lessons.scenes.catalog import as_torque_scene, load_scene
from lessons.scenes.run_spec import RunSpec
from robots import InputError

ROOT = Path(__file__).parents[2]
PROGRAM = ROOT / "docs" / "browser"
TRIED = ("iiwa14-hold", "panda-hold", "planar3-hold")
"""The names of the scenes on the page *Try it*."""
HORIZONS = (1, 2, 5, 10, 20)
"""The horizons N that can be chosen on this page."""


def missing() -> str | None:
    """Returns a sentence that names what this machine lacks for live figures; None if nothing is missing."""
    for program in ("node", "npm"):
        if shutil.which(program) is None:
            return f"live figures need {program}, which is not installed: the site has recordings instead"
    try:
        check_linker()
    except InputError as error:
        return f"no live figures: {error}"
    return None


INVITATION = (
    '<p class="try"><a href="try.html">Try it</a>: drag the target of an iiwa, a Panda or a planar arm '
    "here, in the browser. The figure runs the compiled controller of himpc-lab and loads nothing from "
    "elsewhere.</p>"
)
WITHOUT = (
    "This site was built without Node: lessons have recordings, and nothing is simulated in the browser."
)


def write(site: Path) -> None:
    """Writes try.html and all scripts of the live figures into the folder of a built site."""
    out = site / "live"
    out.mkdir(parents=True)
    told = {name: {"robot": as_torque_scene(load_scene(name), "a live page's").robot.name} for name in TRIED}
    page = (PROGRAM / "try.html").read_text(encoding="utf-8")
    (site / "try.html").write_text(page.replace("@scenes@", json.dumps(told)), encoding="utf-8")
    _program(out / "live.js")
    with (out / "live.js").open("a", encoding="utf-8") as file:
        file.write(f"window.HIMPC_ABOUT={json.dumps(about())};\n")
    wasm = PROGRAM / "node_modules" / "@mujoco" / "mujoco" / "mujoco.wasm"
    (out / "mujoco.js").write_text(wrapped("mujoco", without_names(wasm.read_bytes())))
    (out / "kernel.js").write_text(wrapped("kernel", linked(object_code(target_named("wasm32")))))
    robots: dict[str, Any] = {}
    for name in TRIED:
        scene = as_torque_scene(RunSpec(name).prepared(), "a live page's")
        pack = Pack()
        told = {"scene": scene_data(scene, pack, HORIZONS, wide=True)}
        (out / f"{name}.js").write_text(pack.script(f"scene/{name}", told))
        robots[scene.robot.name] = scene.robot
    for name in COURSE:
        lesson = load_lesson(name)
        script = lesson_script(lesson)
        if script is not None:
            (out / f"{name}.js").write_text(script)
            robots |= robots_of(lesson)
    for name, robot in robots.items():
        (out / f"robot-{name}.js").write_text(robot_script(robot, f"robot/{name}"))


def _program(path: Path) -> None:
    """Bundles the program. If its packages are missing, they are installed first, in the versions of
    package-lock.json."""
    if not (PROGRAM / "node_modules").exists():
        install = ("npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund")
        subprocess.run(install, cwd=PROGRAM, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(("node", "build.mjs", str(path)), cwd=PROGRAM, check=True)


def about() -> str:
    """Returns a text that names the kernel and the commit of the figures, and their differences from
    himpc-lab. The page replaces @mujoco@ by the version of its own MuJoCo."""
    try:
        told = subprocess.run(
            ("git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=10"),
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        told = "not known"
    return (
        f"Kernel {layout_number():014x} of himpc-lab {version('himpc-lab')}, commit {told}, as WebAssembly. "
        f"MuJoCo @mujoco@ simulates the robot; himpc-lab uses MuJoCo {mujoco.__version__}. Unlike himpc-lab, "
        "this page has no controllers that need Python (OSF, HQP, HTMPC), no added tasks, no recordings, no "
        "drawings of the QP, and it lacks a rare fallback. To open the code in himpc-lab: himpc-lab "
        "--state CODE."
    )
