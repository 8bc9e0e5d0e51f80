"""`himpc-lab run`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.commands.lists import HeldJoints, RobotFile, Tool
from app.commands.output import (
    check_file,
    figure,
    print_table,
    progress_bar,
    readable_unit,
    write_file,
    write_json,
)
from robots import InputError

if TYPE_CHECKING:
    from lessons.scenes.run_spec import RunSpec
    from lessons.scenes.scene import Scene


def run(
    scene: tyro.conf.Positional[str | None] = None,
    urdf: RobotFile = None,
    tip: str | None = None,
    tool: Tool = None,
    hold: HeldJoints = (),
    controller: str | None = None,
    task: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="FILE.py")] = (),
    duration: float | None = None,
    seed: int | None = None,
    state: str | None = None,
    settings: bool = False,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    json: str | None = None,
    npz: str | None = None,
) -> int:
    """Run a scene headless, as fast as possible.

    Args:
        scene: name of a scene (see himpc-lab scenes), or a Python file with a scene or task of your own. Not
            with --state.
        urdf: robot for the scene "hold": a URDF or MuJoCo model (.xml), a folder or zip with one, or a name
            of the catalog.
        tip: end-effector frame, for the scene "hold".
        tool: place of a tool in that frame, m and rad; the tool's frame is then the end effector. A number
            with a minus in front: --tool=-0.1,0,0.
        hold: hold the joints with this name or regular expression where the file's home has them, or at 0;
            with PATTERN=VALUE at VALUE (rad or m). For the scene "hold"; e.g. --hold 'left_.*' --hold
            gripper_joint=0.02.
        controller: controller to use instead of the scene's own: a name (see himpc-lab controllers) or a
            Python file of your own.
        task: Python file with a task of your own, for a --state whose stack contains this task. With
            --set stack=… this option is not needed.
        duration: simulated seconds; the scene's own by default.
        seed: seed of the run, from 0 to 2⁶³ − 1; 0, or the state's, by default.
        state: a state code, as the page shows it; the run gets its scene, robot, settings and seed.
        settings: list the settings that --set can change in this scene; run nothing.
        set: change a setting, e.g. --set horizon=10 --set plant.payload_kg=2 --set levels.2.enabled=false.
        json: write the result as JSON to this file, or to standard output for "-".
        npz: write one row per control tick to this file, with exactly this name.
    """
    from lessons.recording.arrays import arrays, as_npz
    from lessons.recording.run import run
    from lessons.recording.summary import summary
    from lessons.scenes.run_spec import tip_with_tool

    spec = _given(scene, urdf, tip_with_tool(tip, tool), hold, state)
    if controller is not None:
        told = (each for each in spec.set if not each.startswith("controller="))
        spec = replace(spec, controller=controller, set=tuple(told))
    seed = spec.seed if seed is None else seed  # if given, it replaces the seed of the state code
    spec = replace(spec, duration=duration, seed=seed, tasks=task).admitting(*set)
    loaded = spec.prepared()
    if settings:
        return _list(loaded, json)
    check_file("--json", json)
    check_file("--npz", npz)
    with progress_bar(f"{spec.scene} …", json is None) as progress:
        recording = run(loaded, None, spec.seed, progress)
    result = summary(recording)
    if npz is not None:
        how = {
            "scene": spec.scene,
            "urdf": spec.urdf,
            "tip": spec.tip,
            "hold": list(spec.hold),
            "controller": result["controller"],
            "seed": spec.seed,
            "duration": recording.duration,
            "set": list(spec.set),
        }
        write_file("--npz", npz, as_npz(arrays(recording, how)))
    if json is not None:
        write_json(result, json)
    else:
        _show(result)
    return 0


def _given(
    scene: str | None, urdf: str | None, tip: str | None, hold: tuple[str, ...], code: str | None
) -> RunSpec:
    """Returns the run to execute: the named scene, or the run of a state code."""
    from lessons.replay.state import decode
    from lessons.scenes.run_spec import RunSpec

    if code is None:
        if scene is None:
            raise InputError("run needs a scene, e.g. himpc-lab run iiwa14-hold, or --state CODE")
        return RunSpec(scene, urdf, tip, hold=hold)
    if (scene, urdf, tip, hold) != (None, None, None, ()):
        others = "the scene, --urdf, --tip, --tool and --hold"
        raise InputError(f"--state brings its own scene and robot: leave out {others}")
    return decode(code).run


def _list(scene: Scene, json: str | None) -> int:
    from lessons.settings.listing import lines

    found = lines(scene.settings)
    if json is not None:
        write_json([vars(line) for line in found], json)
        return 0
    rows = [[line.path, line.now, line.allowed, line.unit, line.help] for line in found]
    print_table(f"Settings of {scene.name} for --set", ("path", "now", "allowed", "unit", "what it is"), rows)
    return 0


def _show(result: dict[str, Any]) -> None:
    solver, limits, step = result["solver"], result["limits"], result["step_ms"]
    rows = [
        [
            str(task["level"]),
            task["name"],
            axis,
            readable_unit(late, task["unit"])[0],
            *readable_unit(peak, task["unit"]),
        ]
        for task in result["tasks"]
        for axis, late, peak in zip(
            task["coordinates"], task["rmse_after_1s"] or task["rmse"], task["max_abs"], strict=True
        )
    ]
    columns = ("level", "task", "axis", "RMSE after 1 s", "largest", "unit")
    ending = f"out of control at {result['diverged_at_s']:.3f} s" if result["diverged"] else "completed"
    title = f"{result['scene']} · {result['controller']} · {result['duration_s']:g} s simulated, {ending}"
    print_table(title, columns, rows)
    fallbacks = ", ".join(f"{fallback} {count}" for fallback, count in solver["fallbacks"].items()) or "none"
    pairs = {
        "largest share of its limit": ", ".join(
            f"{kind} {figure(limits[kind]['max_ratio'])}"
            for kind in limits
            if limits[kind]["max_ratio"] is not None
        ),
        "QPs": f"{solver['solves']} ({solver['backend'] or 'no QP solver'}, {solver['route']}), "
        f"unsolved {solver['unsolved']}, fallbacks {fallbacks}, "
        f"largest KKT residual {figure(solver['max_kkt_residual'], 0.0)}",
        **_ranks(result),
        "leak into higher levels": _leak(result),
        **_mission(result),
        "control step": f"median {step['median']:.2f} ms, p99 {step['p99']:.2f} ms",
        "speed": f"{result['real_time_factor']:.1f} × real time",
    }
    width = max(map(len, pairs))
    for name, value in pairs.items():
        print(f"{name:{width}}  {value}")
    if result.get("warning"):
        print(result["warning"])


def _ranks(result: dict[str, Any]) -> dict[str, str]:
    """Returns the rank of each level; empty if every level gets all directions of its tasks."""
    levels = result.get("levels", ())
    if all(level["rank"] == level["rows"] for level in levels):
        return {}
    found = ", ".join(f"{level['name']} {level['rank']} of {level['rows']}" for level in levels)
    return {"directions that a level gets": found}


def _leak(result: dict[str, Any]) -> str:
    own = figure(result["priority_leak_max"])
    if "line_search" in result:
        return f"{own} m"
    return f"controller's {own}, plant's {figure(result['dynamic_leak_max'])} m/s² or rad/s²"


def _mission(result: dict[str, Any]) -> dict[str, str]:
    """Returns the figures that only velocity-level scenes have."""
    found = {
        part["name"]: f"base error {figure(part['normalised_base_error'])} of the initial error on average, "
        f"{figure(part['final_base_error'])} at the end; hand {figure(part['ee_error_mm']['mean'])} mm "
        f"on average, {figure(part['ee_error_mm']['max'])} mm at most"
        for part in result.get("parts", ())
    }
    if result.get("base_path_m") is not None:
        found["way of the base"] = f"{result['base_path_m']:.2f} m"
    if result.get("completed"):
        found["mission"] = f"completed after {result['completion_time_s']:.1f} s"
    return found
