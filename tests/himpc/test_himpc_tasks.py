"""For every kind of task, the Jacobian is the derivative of the value, and the torque depends on its rows."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.kinematics.configuration import Configuration
from himpc.references import Hold
from himpc.tasks import (
    KINDS,
    CentreOfMass,
    Damping,
    FrameOrientation,
    FramePosition,
    Joints,
    PlaneDistance,
    Pointing,
    Posture,
    RelativeOrientation,
    RelativePosition,
    Task,
)
from robots import CATALOG, InputError, Robot, load_robot

Array = NDArray[np.float64]
H = 1e-6


@cache
def robot_of(name: str) -> Robot:
    return load_robot(name)


def tasks_of(robot: Robot, rng: np.random.Generator) -> list[Task]:
    """Returns one task of every class, for randomly chosen links."""
    frame, root = (str(each) for each in rng.choice(robot.frames, 2, replace=False))
    axes = str(rng.choice(["xyz", "xy", "z"]))
    normal = tuple(rng.normal(size=3).tolist())
    return [
        FramePosition(name="position", frame=frame, axes=axes),
        FrameOrientation(name="orientation", frame=frame, axes=axes),
        Joints(name="joints", joints=robot.joint_names[:2]),
        Posture(name="posture"),
        Damping(name="damping"),
        CentreOfMass(name="com", axes=axes),
        RelativePosition(name="relative_position", frame=frame, root=root, axes=axes),
        RelativeOrientation(name="relative_orientation", frame=frame, root=root, axes=axes),
        Pointing(name="pointing", frame=frame, axis=str(rng.choice(["x", "y", "z", "-x", "-y", "-z"]))),
        PlaneDistance(name="plane", frame=frame, normal=normal, offset=float(rng.normal())),
    ]


def test_every_class_is_among_them() -> None:
    """`tasks_of` returns a task of every class."""
    made = {type(task) for task in tasks_of(robot_of("iiwa14"), np.random.default_rng(0))}
    assert made == {kind for each in KINDS.values() for kind in each.makes}


def change(after: Array, before: Array) -> Array:
    """Returns the difference after ⊖ before, for coordinates or rotations."""
    return pin.log3(after @ before.T) if after.ndim == 2 else after - before


@pytest.mark.parametrize("name", CATALOG)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_jacobians_are_derivatives(name: str, seed: int) -> None:
    """The Jacobian equals central differences of the value along every joint, at the measured state and at
    one knot."""
    robot, rng = robot_of(name), np.random.default_rng(seed)
    data, n = robot.model.createData(), robot.n
    q, knot = rng.uniform(-1.5, 1.5, (2, n))
    tasks = tasks_of(robot, rng)
    previews = {"pointing": Hold(rng.normal(size=3) * 2).preview(0.0, 1e-3, 2)}

    def at(q: Array) -> Configuration:
        return Configuration(robot, data, q, np.zeros(n), previews=previews)

    both = Configuration(robot, data, q, np.zeros(n), [knot], previews)
    for task in tasks:
        J = task.jacobian(both)
        m = len(task.coordinates(robot))
        assert J.shape == (2, m, n)
        for place, where in enumerate((q, knot)):
            value = task.value(at(where))
            if isinstance(task, Pointing) and np.linalg.norm(value) > 3.0:
                continue  # near the opposite direction the value cannot be differentiated
            for joint, nudge in enumerate(H * np.eye(n)):
                moved = change(task.value(at(where + nudge)), task.value(at(where - nudge))) / (2 * H)
                if moved.size != m:
                    moved = moved[task.components]  # pyright: ignore[reportAttributeAccessIssue]
                np.testing.assert_allclose(
                    J[place, :, joint], moved, atol=3e-6 * (1 + np.abs(J[place]).max()), err_msg=task.name
                )
        target = task.target(at(q))
        if not isinstance(task, Pointing):
            np.testing.assert_allclose(task.error(task.value(at(q)), target), np.zeros(m), atol=1e-9)


def test_the_centre_of_mass_is_that_of_what_moves() -> None:
    """The centre of mass excludes Baxter's torso and head, 36.3 kg, which are fixed to the world; the
    docstring of the task says so."""
    robot = robot_of("baxter")
    model, data = robot.model, robot.model.createData()
    assert model.inertias[0].mass == pytest.approx(36.3, abs=0.05)
    assert "36.3 kg" in str(CentreOfMass.__doc__)
    pin.forwardKinematics(model, data, robot.home)
    pairs = [(model.inertias[j], data.oMi[j]) for j in range(1, model.njoints)]
    moment = sum(inertia.mass * place.act(inertia.lever) for inertia, place in pairs)
    value = CentreOfMass(name="com").value(Configuration(robot, data, robot.home, np.zeros(14)))
    np.testing.assert_allclose(value, moment / sum(inertia.mass for inertia, _ in pairs), atol=1e-12)


def test_pointing_is_told_by_its_angle() -> None:
    """‖x‖ is the angle between the axis and the direction to the point. It is zero at the initial target, and
    finite everywhere."""
    robot = robot_of("iiwa14")
    task, data = Pointing(name="look"), robot.model.createData()
    here = Configuration(robot, data, robot.home, np.zeros(7))
    place = here.placement()
    for point in (task.target(here), place.translation, place.translation - place.rotation[:, 2]):
        previews = {"look": Hold(np.array(point)).preview(0.0, 1e-3, 1)}
        told = Configuration(robot, data, robot.home, np.zeros(7), previews=previews)
        assert np.isfinite(task.value(told)).all()
        assert np.isfinite(task.jacobian(told)).all()
        assert np.isfinite(task.reference_in_task_coordinates(told, previews["look"]).velocity).all()
    ahead, aside = place.rotation[:, 2], place.rotation[:, 0]
    previews = {
        "look": Hold(place.translation + np.cos(0.4) * ahead + np.sin(0.4) * aside).preview(0, 1e-3, 1)
    }
    told = Configuration(robot, data, robot.home, np.zeros(7), previews=previews)
    np.testing.assert_allclose(task.value(told), [0.4, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: CentreOfMass(name="a", axes="xq"), "give some of x, y and z"),
        (lambda: Pointing(name="a", axis="w"), "-x"),
        (lambda: PlaneDistance(name="a", normal=(0.0, 0.0, 0.0)), "normal"),
        (lambda: PlaneDistance(name="a", normal=(1.0, 0.0)), "normal"),
        (lambda: PlaneDistance(name="a", offset=float("nan")), "offset"),
    ],
)
def test_what_cannot_be_is_one_sentence(wrong: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        wrong()  # pyright: ignore[reportCallIssue]


def test_every_kind_says_what_it_is() -> None:
    for kind in KINDS.values():
        assert kind.says
        assert len(kind.makes) == len(kind.suffixes)


# ------------------------------------------------------------------ rows that are not built into the kernel
