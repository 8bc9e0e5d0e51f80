"""For tasks of every kind in sessions, the kernel and the printed equations agree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from printed_levels import off_printed

from himpc.kinematics.configuration import Configuration
from himpc.rotation import exp3, quaternion
from himpc.stack import Level
from himpc.tasks import (
    CentreOfMass,
    FrameOrientation,
    PlaneDistance,
    Pointing,
    RelativeOrientation,
    RelativePosition,
)
from himpc.tasks.axes import FrameTask
from lessons.events import MoveTarget
from lessons.scenes.catalog import as_torque_scene, torque_scene
from lessons.scenes.run_spec import AS_PRINTED, RunSpec
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]


FAR = {
    "two_axes": (0.1, 0.1, 1.7),
    "one_axis": (1.7, 0.1, 0.1),
    "relative_two_axes": (1.7, 0.1, 0.1),
    "relative_one_axis": (1.7, 0.1, 0.1),
}
"""Angles by which the target of an orientation on some axes is turned away, rad."""

GIVEN = {
    "two_axes": lambda: FrameOrientation(name="x", axes="xy", K_p=60.0, K_v=15.0),
    "one_axis": lambda: FrameOrientation(name="x", axes="z", K_p=60.0, K_v=15.0),
    "relative_two_axes": lambda: RelativeOrientation(name="x", root="link_3", axes="yz", K_p=60.0, K_v=15.0),
    "relative_one_axis": lambda: RelativeOrientation(name="x", root="link_3", axes="y", K_p=60.0, K_v=15.0),
    "com": lambda: CentreOfMass(name="x", axes="xy", K_p=60.0, K_v=15.0),
    "relative": lambda: RelativePosition(name="x", root="link_3", K_p=60.0, K_v=15.0),
    "relative_turn": lambda: RelativeOrientation(name="x", root="link_3", K_p=60.0, K_v=15.0),
    "pointing": lambda: Pointing(name="x", frame="link_5", K_p=60.0, K_v=15.0),
    "plane": lambda: PlaneDistance(name="x", normal=(1.0, 0.0, 1.0), K_p=60.0, K_v=15.0),
}


@pytest.mark.parametrize(
    ("controller", "place"), [("himpc", 0), ("himpc", 1), ("nhimpc", 0), ("weighted", 0)]
)
@pytest.mark.parametrize("kind", GIVEN)
def test_torques_with_any_kind_are_printed(kind: str, place: int, controller: str) -> None:
    """The closed loops agree while the target moves; the kernel receives the rows of the task. Of nhimpc and
    weighted, each level is compared.

    Orientations on one or two axes are computed by the kernel itself; their targets start 100° away, mostly
    about a free axis."""
    scene = as_torque_scene(RunSpec("iiwa14-hold").but(*AS_PRINTED).prepared(), "it")
    levels = list(scene.settings.levels)
    levels.insert(place, Level((GIVEN[kind](),)))
    taken = replace(scene.settings, stack=tuple(levels), controller=controller)
    compiled, printed = (
        TorqueSession(replace(scene, settings=replace(taken, controller=each)))
        for each in (controller, "himpc_printed")
    )
    alone = controller != "himpc"
    sessions = (compiled,) if alone else (compiled, printed)
    for session in sessions:
        target = session.target("x")
        if target is not None and kind in FAR:
            target.jump(exp3(np.array(FAR[kind])) @ target.raw)
    worst = moved = 0.0
    for k in range(60):
        for session in sessions:
            target = session.target("x")
            assert target is not None
            if k == 5:
                turned = target.raw.ndim == 2
                value = quaternion(exp3(np.full(3, 0.1)) @ target.raw) if turned else target.raw + 0.1
                session.post(MoveTarget("x", tuple(value)))
            session.tick()
        assert compiled.plan is not None
        moved = max(moved, float(np.abs(compiled.plan.errors["x"]).max()))
        if alone:
            worst = max(worst, off_printed(compiled.controller, compiled.plan))
            continue
        assert printed.plan is not None
        worst = max(worst, float(np.abs(compiled.plan.tau - printed.plan.tau).max()))
        for name, value in printed.plan.values.items():
            np.testing.assert_allclose(compiled.plan.values[name], value, atol=1e-9)
            np.testing.assert_allclose(compiled.plan.errors[name], printed.plan.errors[name], atol=1e-9)
    assert moved > 1e-4
    assert worst <= (1e-7 if controller == "weighted" else 1e-8)


@dataclass(frozen=True, kw_only=True)
class OwnTurn(FrameTask):
    """A user's own task; its value is a rotation, and it controls some axes of it."""

    first_row: ClassVar[int] = 3
    unit: ClassVar[Literal["m", "rad"]] = "rad"

    def value(self, configuration: Configuration) -> Array:
        return configuration.placement(self.frame).rotation

    def error(self, value: Array, desired: Array) -> Array:
        return pin.log3(value @ desired.T)[self.components]


@pytest.mark.parametrize("controller", ["himpc", "himpc_printed", "hqp"])
def test_an_own_rotation_on_some_axes_is_told_of_these(controller: str) -> None:
    """The target of the task rotates about all axes; its previewed derivatives have as many columns as the
    task has rows."""
    scene = torque_scene("iiwa14-hold")
    levels = (scene.settings.levels[0], Level((OwnTurn(name="x", axes="xy"),)), scene.settings.levels[2])
    taken = replace(scene.settings, stack=levels, controller=controller)
    session = TorqueSession(replace(scene, settings=taken))
    target = session.target("x")
    assert target is not None
    session.tick()
    session.post(MoveTarget("x", tuple(quaternion(exp3(np.array([0.1, 0.0, 0.0])) @ target.raw))))
    for _ in range(200):
        session.tick()
    assert session.plan is not None
    assert session.plan.values["x"].shape == (3, 3)
    assert session.failure is None
    assert 0.0 < np.linalg.norm(session.plan.errors["x"]) < 0.01
