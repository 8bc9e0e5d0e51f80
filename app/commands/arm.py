"""`himpc-lab arm`."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.commands.export import WITHOUT
from robots import InputError

if TYPE_CHECKING:
    from app.arm.drive import Driven
    from himpc.export.image import Image
    from lessons.scenes.torque_scene import TorqueScene
    from robots.arms.arm import Arm

SIMULATED = "simulated"
_LONGEST_DELAY = 20
_LONGEST = 600.0  # s; limited, as every row is stored in memory


def arm(
    scene: tyro.conf.Positional[str],
    robot: str,
    urdf: str | None = None,
    tip: str | None = None,
    controller: str | None = None,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    drag: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="TIME:TASK=X,Y,Z")
    ] = (),
    duration: float | None = None,
    distance: float = 0.2,
    missed: int = 10,
    missed_share: float = 0.2,
    delay: int = 0,
    real_time: bool = False,
    npz: str | None = None,
    plot: str | None = None,
    page: bool = False,
    port: int = 8080,
    no_browser: bool = False,
) -> int:
    """Drive a Franka arm by a scene's exported controller, and compare it with a simulated arm.

    Args:
        scene: name of a scene with this arm as its robot, e.g. panda-hold. The targets begin at the arm's
            pose.
        robot: address of the arm, or "simulated" for an arm that is simulated in MuJoCo, with the same
            interface.
        urdf: URDF file or catalog name, for the scene "hold".
        tip: end-effector frame, for the scene "hold".
        controller: himpc, hiqp, nhimpc or weighted; the scene's own by default.
        set: change a setting, e.g. --set M_bar_scale=2 --set limits.velocity_scale=0.3.
        drag: move the target of a task at a time in seconds, e.g. --drag 2:position=0,0.05,0.
        duration: seconds after which the arm is stopped gently; 10 by default, 600 with --page.
        distance: largest distance of a joint from the simulated joint, rad.
        missed: number of periods that may be missed one after another.
        missed_share: share of the periods that may be missed within about a second; 1: all of them.
        delay: number of periods after which a torque acts; 0: use the torque that the arm reports.
        real_time: refuse to run if the kernel has no real-time scheduling.
        npz: write one row per period to this file.
        plot: draw the motion of arm and model, errors and torques as arm.png in this folder.
        page: open the page, which shows the arm and, as a ghost, the simulated arm. Run starts the drive,
            dragged targets move both arms, and closing the page stops the arm gently.
        port: port of the page, on this machine only.
        no_browser: do not open a browser.
    """
    from app.arm.drive import Drive, drive
    from app.arm.guard import Tolerances
    from app.arm.model import Model
    from app.arm.prepared import check_start, maker, nominal, prepared
    from app.link.choice import SceneChoice
    from himpc.export.native import build
    from lessons.scenes.catalog import as_torque_scene
    from lessons.scenes.run_spec import RunSpec

    if duration is None:
        duration = _LONGEST if page else 10.0
    if not 0.0 < duration <= _LONGEST:
        raise InputError(f"--duration is {duration} s: give a time above 0 and at most {_LONGEST:g}")
    if not distance > 0.0:
        raise InputError(f"--distance is {distance}: give a distance above 0")
    if not 0 <= delay <= _LONGEST_DELAY:
        raise InputError(f"--delay is {delay}: give a number of periods from 0 to {_LONGEST_DELAY}")
    if missed < 0:
        raise InputError(f"--missed is {missed}: give a number of periods, 0 or more")
    if not 0.0 <= missed_share <= 1.0:
        raise InputError(f"--missed-share is {missed_share}: give a share from 0 to 1")
    plain = RunSpec(scene, urdf, tip, controller=controller).for_export()
    spec = plain.but(*set)
    loaded = as_torque_scene(spec.prepared(), "an arm")
    print(WITHOUT, flush=True)
    limits, start = _found(loaded, robot, real_time)
    beside = nominal(loaded, as_torque_scene(plain.prepared(), "an arm"))
    ready = prepared(beside, start, limits, drag)
    with tempfile.TemporaryDirectory() as folder:
        print("compiling the controller: up to a minute the first time …", flush=True)
        make = maker(build(Path(folder)), ready.image)
        check_start(make(), start)
        period = loaded.settings.T_s
        wanted = Drive(
            arm=lambda: _arm(loaded, robot, real_time, start),
            controller=make,
            limits=ready.limits,
            start=start,
            period=period,
            duration=duration,
            drags=ready.drags,
            tolerances=Tolerances(missed=missed, missed_share=missed_share, distance=distance),
            delay=delay,
        )
        model = Model(ready.plant, make(), ready.limits, period)
        how: dict[str, Any] = {"scene": scene, "robot": robot, "set": list(set), "drag": list(drag)}
        if page:
            from app.commands.arm_page import drive_on_a_page

            choice = SceneChoice.of_run(spec)
            end = partial(_finish, image=ready.image, npz=npz, plot=plot, how=how)
            return drive_on_a_page(choice, ready, wanted, model, end, port, not no_browser)
        driven = drive(wanted, model, lambda text: print(text, flush=True))
    return _finish(driven, ready.image, npz, plot, how)


def _finish(driven: Driven, image: Image, npz: str | None, plot: str | None, how: dict[str, Any]) -> int:
    """Prints the reason of a drive's end, writes its files, and returns the exit code."""
    from app.arm.recorded import arrays

    rest = "it came to rest under control" if driven.gently else "it did not come to rest under control"
    print(f"ended: {driven.why}; {rest}", flush=True)
    data = arrays(driven, image)
    if npz is not None:
        _save(npz, data, how)
        print(f"{len(driven.rows)} rows written to {npz}", flush=True)
    if plot is not None and len(driven.rows):
        print(f"drawn: {_drawn(plot, data, image)}", flush=True)
    return 0 if driven.wanted and driven.gently else 1


def _arm(scene: TorqueScene, robot: str, real_time: bool, start: Any) -> Arm:
    """Returns the arm, which is not yet under control."""
    from robots import Plant
    from robots.arms.franka import Franka
    from robots.arms.simulated_arm import SimulatedArm

    if robot != SIMULATED:
        return Franka(robot, real_time)
    plant = Plant(scene.robot, scene.settings.plant, scene.settings.T_s, scene.world)
    plant.reset(start)
    return SimulatedArm(plant, scene.settings.T_s)


def _found(scene: TorqueScene, robot: str, real_time: bool) -> tuple[Any, Any]:
    """Returns the limits of the arm and its joint positions."""
    from robots.arms.arm import ArmLost
    from robots.arms.franka import Franka

    if robot == SIMULATED:
        return _arm(scene, robot, real_time, scene.q_0).limits, scene.q_0
    if scene.settings.T_s != 1e-3:
        raise InputError(f"T_s is {scene.settings.T_s} s: a Franka arm needs a torque every 0.001 s")
    there = Franka(robot, real_time)
    try:
        return there.limits, there.at_rest(scene.robot)
    except ArmLost as error:
        raise InputError(f"--robot {robot}: {error}") from None


def _save(path: str, data: dict[str, Any], how: dict[str, Any]) -> None:
    import numpy as np

    try:
        np.savez_compressed(path, **data, settings=np.array(json.dumps(how)))
    except OSError as error:
        raise InputError(f"--npz {path}: cannot be written ({error.strerror}); give another file") from None


def _drawn(folder: str, data: dict[str, Any], image: Image) -> Path:
    from app.arm.picture import picture
    from lessons.plots.draw import draw

    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        return draw(picture("arm", data, image), Path(folder))
    except OSError as error:
        raise InputError(
            f"--plot {folder}: cannot be written ({error.strerror}); give another folder"
        ) from None
