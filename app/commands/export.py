"""`himpc-lab export`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.commands.lists import HeldJoints, RobotFile, Tool
from robots import InputError

if TYPE_CHECKING:
    from himpc.export.folder import Recorded
    from lessons.scenes.scene import TorqueScene


def export(
    scene: tyro.conf.Positional[str],
    target: str,
    out: str,
    urdf: RobotFile = None,
    tip: str | None = None,
    tool: Tool = None,
    hold: HeldJoints = (),
    controller: str | None = None,
    stack: str | None = None,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    ticks: int = 1000,
    seed: int = 0,
    prefix: str = "himpc",
    budget: float | None = None,
) -> int:
    """Write a scene's controller as C or WebAssembly: code, parameters, header, and a recorded run to replay.

    Args:
        scene: name of a scene (see himpc-lab scenes).
        target: wasm32, x86_64-linux, aarch64-linux, x86_64-macos, aarch64-macos or x86_64-windows.
        out: folder for the files; it is created if it does not exist.
        urdf: robot for the scene "hold": a URDF or MuJoCo model (.xml), a folder or zip with one, or a name
            of the catalog.
        tip: end-effector frame, for the scene "hold".
        tool: place of a tool in that frame, m and rad; the tool's frame is then the end effector. A number
            with a minus in front: --tool=-0.1,0,0.
        hold: hold the joints with this name or regular expression, as for himpc-lab run.
        controller: himpc, hiqp, nhimpc or weighted; the scene's own by default.
        stack: the levels as JSON, as --set stack=… of himpc-lab run takes them.
        set: change a setting, e.g. --set horizon=10 --set levels.2.enabled=false.
        ticks: length of the recorded run, in periods.
        seed: seed of the recorded run, from 0 to 2⁶³ − 1.
        prefix: first part of all names in C, for programs with more than one exported controller.
        budget: largest number of multiplications for changes of active rows in a period; by default that of
            himpc-lab, at most 50 million. It bounds the time of a period, since the code reads no clock.
    """
    from himpc.export.entries import PREFIX
    from himpc.export.folder import files_of
    from himpc.export.header import check_prefix
    from himpc.export.image import image_of
    from himpc.export.link import check_linker
    from himpc.export.objects import target_named
    from himpc.limits import in_force
    from lessons.own.files import is_file
    from lessons.scenes.catalog import as_torque_scene
    from lessons.scenes.run_spec import RunSpec, tip_with_tool
    from lessons.session.distances import objects_of
    from lessons.session.torque import TorqueSession
    from robots.mechanics.model import saved

    wanted = target_named(target)
    check_prefix(prefix)
    if target == "wasm32" and prefix != PREFIX:
        raise InputError(
            "--prefix changes names in C: a module of the target wasm32 needs none, leave it out"
        )
    if budget is not None and not 0.0 < budget <= 1e9:
        raise InputError(f"--budget is {budget:g}: give a number above 0 and at most 1e9")
    if not 1 <= ticks <= 100_000:
        raise InputError(f"--ticks is {ticks}: give a number from 1 to 100000")
    if target == "wasm32":
        check_linker()
    for each in (scene, controller or ""):
        if is_file(each):
            raise InputError(
                f"{each} is Python, which export cannot translate: give a scene and a controller of the lab"
            )
    assignments = (*([f"stack={stack}"] if stack is not None else ()), *set)
    tip = tip_with_tool(tip, tool)
    spec = RunSpec(scene, urdf, tip, controller=controller, seed=seed, hold=hold).but(*assignments)
    loaded = as_torque_scene(spec.prepared(), "export's")
    session = TorqueSession(replace(loaded, events=()), seed)
    image = image_of(
        session.controller, loaded.robot, session.references, budget, observed=objects_of(session.plant)
    )
    force = in_force(loaded.robot, loaded.settings.for_controller().limits)
    torques = [
        max(*pair) for pair in zip(loaded.robot.tau_limit.tolist(), force.tau_upper.tolist(), strict=True)
    ]
    folder = _made(out)
    print("compiling the controller: up to a minute …", flush=True)
    settings = loaded.settings
    plant = saved(loaded.robot, settings.plant, loaded.world, settings.T_s)
    files = files_of(image, wanted, torques, recorded(loaded, ticks, seed), target, plant, prefix)
    _write(folder, files)
    for name, content in files.items():
        print(f"{len(content):9,} bytes  {folder / name}")
    print(f"build and replay: see {folder / 'README.md'}")
    return 0


def recorded(scene: TorqueScene, ticks: int, seed: int) -> Recorded:
    """Runs a scene in closed loop with the simulated robot. After a tenth of the time, the first position
    target that can be dragged moves by 5 cm. Then the first orientation target turns by 0.2 rad."""
    import numpy as np

    from himpc.export.folder import Move, Recorded
    from himpc.rotation import exp3, quaternion
    from lessons.events import MoveTarget
    from lessons.session.torque import TorqueSession

    session = TorqueSession(replace(scene, events=()), seed)
    moves: list[Move] = []
    names = [task.name for level in session.settings.levels for task in level.tasks]
    wanted: dict[int, tuple[str, tuple[float, ...]]] = {}
    for name in names:
        target = session.target(name)
        if target is None:
            continue
        task = next(each for level in session.settings.levels for each in level.tasks if each.name == name)
        if task.unit == "m" and target.raw.ndim == 1 and ticks // 10 not in wanted:
            full = np.zeros(3)
            full[getattr(task, "components", slice(target.raw.size))] = target.raw + 0.05 / np.sqrt(
                target.raw.size
            )
            wanted[ticks // 10] = name, tuple(full.tolist())
        elif target.raw.ndim == 2 and len(getattr(task, "axes", "xyz")) == 3 and ticks // 5 not in wanted:
            turned = quaternion(exp3(np.array([0.2, 0.0, 0.0])) @ target.raw)
            wanted[ticks // 5] = name, tuple(turned.tolist())
    rows = np.empty((ticks, 4, scene.robot.n))
    for k in range(ticks):
        if k in wanted:
            name, value = wanted[k]
            session.post(MoveTarget(name, value))
            moves.append(Move(k, names.index(name), value))
        applied = session.plant.tau.copy()
        session.tick()
        given, plan = session.controller_input, session.plan
        assert given is not None and plan is not None
        rows[k] = given.q, given.v, applied, plan.tau
    return Recorded(moves, rows)


def _made(out: str) -> Path:
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be created ({error.strerror}); give another folder") from None
    return folder


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    from lessons.outputs import write_files

    try:
        write_files({folder / name: content for name, content in files.items()})
    except OSError as error:
        raise InputError(
            f"--out {folder}: cannot be written ({error.strerror}); give another folder"
        ) from None
