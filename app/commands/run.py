"""`himpc-lab run`."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Annotated, Any

import tyro

from app.commands.output import print_table, write_json
from robots import InputError


def run(
    scene: tyro.conf.Positional[str],
    urdf: str | None = None,
    tip: str | None = None,
    controller: str = "himpc",
    duration: float | None = None,
    seed: int = 0,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    json: str | None = None,
    npz: str | None = None,
) -> int:
    """Run a scene headless, as fast as it goes.

    Args:
        scene: name of a scene; see himpc-lab scenes.
        urdf: URDF file or catalog name, for the scene "hold".
        tip: end-effector frame, for the scene "hold".
        controller: which controller; see himpc-lab controllers.
        duration: simulated seconds; the scene's own by default.
        seed: seed of the run.
        set: change a setting, e.g. --set horizon=10 --set plant.payload_kg=2 --set levels.2.enabled=false.
        json: write the result as JSON to this file, or to standard output for "-".
        npz: write one row per control tick to this file.
    """
    from lessons.run import run as run_scene
    from lessons.run import with_assignments
    from lessons.scenes import load_scene
    from lessons.settings import changed
    from lessons.summary import arrays, summary

    loaded = load_scene(scene, urdf, tip)
    settings = with_assignments(changed(loaded.settings, "controller", controller), set)
    loaded = replace(loaded, settings=settings)
    if json is None and sys.stderr.isatty():
        from rich.progress import Progress

        with Progress(transient=True) as bar:
            task = bar.add_task(f"{scene} …", total=1.0)
            recording = run_scene(loaded, duration, seed, lambda share: bar.update(task, completed=share))
    else:
        recording = run_scene(loaded, duration, seed)
    result = summary(recording)
    if npz is not None:
        how = {"scene": scene, "urdf": urdf, "tip": tip, "controller": controller, "seed": seed}
        _save(npz, arrays(recording, {**how, "duration": recording.duration, "set": list(set)}))
    if json is not None:
        write_json(result, json)
    else:
        _show(result)
    return 0


def _save(path: str, data: dict[str, Any]) -> None:
    import numpy as np

    try:
        np.savez_compressed(path, **data)
    except OSError as error:
        raise InputError(f"--npz {path}: cannot be written ({error.strerror}); give another file") from None


def _show(result: dict[str, Any]) -> None:
    solver, limits, step = result["solver"], result["limits"], result["step_ms"]
    rows = [
        [str(task["level"]), task["name"], axis, _figure(late), _figure(peak), task["unit"]]
        for task in result["tasks"]
        for axis, late, peak in zip(
            task["coordinates"], task["rmse_after_1s"] or task["rmse"], task["max_abs"], strict=True
        )
    ]
    columns = ("level", "task", "axis", "RMSE after 1 s", "largest", "unit")
    ending = f"out of control at {result['diverged_at_s']:.3f} s" if result["diverged"] else "completed"
    title = f"{result['scene']} · {result['controller']} · {result['duration_s']:g} s simulated, {ending}"
    print_table(title, columns, rows)
    fallbacks = ", ".join(f"{rung} {count}" for rung, count in solver["fallbacks"].items()) or "none"
    pairs = {
        "largest share of its limit": ", ".join(
            f"{kind} {_figure(limits[kind]['max_ratio'])}" for kind in ("torque", "velocity", "position")
        ),
        "QPs": f"{solver['solves']} ({solver['backend']}, {solver['route']}), unsolved {solver['unsolved']}, "
        f"fallbacks {fallbacks}, largest KKT residual {_figure(solver['max_kkt_residual'])}",
        "leak into higher levels": f"controller's {_figure(result['priority_leak_max'])}, "
        f"plant's {_figure(result['dynamic_leak_max'])} m/s² or rad/s²",
        "control step": f"median {step['median']:.2f} ms, p99 {step['p99']:.2f} ms",
        "speed": f"{result['real_time_factor']:.1f} × real time",
    }
    width = max(map(len, pairs))
    for name, value in pairs.items():
        print(f"{name:{width}}  {value}")


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"
