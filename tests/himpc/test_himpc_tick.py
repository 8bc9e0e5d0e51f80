"""The kinematics of the compiled tick agree with Pinocchio's, and its torques with the printed equations."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pinocchio as pin
import pytest
from cascade_checks import assert_agree, assert_sound, exact_increments, off
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from problems import Hierarchy, random_hierarchy, shifted

from himpc import HIMPC, FrameOrientation, FramePosition, Level, Posture, Settings
from himpc.references import Circle, FigureEight, Hold, Outlook, Phase, Reference, Sinusoid
from himpc.tick.tick import CompiledTick
from robots import Robot, load_robot
from robots.loading.importing import import_robot

INERTIAL = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LIMIT = '<limit lower="-2" upper="2" velocity="3" effort="50"/>'
Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)


# ------------------------------------------------------------------ kinematics


def random_tree(seed: int) -> Robot:
    """Returns a tree of revolute and prismatic joints about random axes, each on a random earlier link. The
    URDF is read in this process, because it comes from a trusted source."""
    rng = np.random.default_rng(seed)

    def joint(number: int) -> str:
        axis, place, turn = rng.normal(size=3), rng.uniform(-0.5, 0.5, 3), rng.uniform(-3, 3, 3)
        kind = "prismatic" if rng.random() < 0.3 else "revolute"
        return (
            f'<joint name="j{number}" type="{kind}"><parent link="l{rng.integers(0, number)}"/>'
            f'<child link="l{number}"/>{_origin(place, turn)}<axis xyz="{_text(axis)}"/>{LIMIT}</joint>'
        )

    n = int(rng.integers(2, 9))
    fixed = (
        f'<joint name="tool" type="fixed"><parent link="l{n}"/><child link="tip"/>'
        f"{_origin(rng.uniform(-0.3, 0.3, 3), rng.uniform(-3, 3, 3))}</joint>"
    )
    links = [f'<link name="l{k}">{INERTIAL if k else ""}</link>' for k in range(n + 1)]
    parts = (*links, '<link name="tip"/>', *(joint(k) for k in range(1, n + 1)), fixed)
    text = f'<robot name="tree">{"".join(parts)}</robot>'
    return import_robot(text.encode(), f"tree {seed}", tip="tip").used()


def _text(numbers: Array) -> str:
    return " ".join(f"{number:.6f}" for number in numbers)


def _origin(place: Array, turn: Array) -> str:
    return f'<origin xyz="{_text(place)}" rpy="{_text(turn)}"/>'


@given(seeds)
@settings(max_examples=60)
def test_kinematics_are_pinocchio_s(seed: int) -> None:
    """Positions, rotations, log₃ and Jacobians of random trees in random states agree to 1e-12."""
    robot = random_tree(seed)
    rng = np.random.default_rng(seed)
    stack = (
        Level((FramePosition(name="position"), FrameOrientation(name="orientation"))),
        Level((Posture(name="posture"),)),
    )
    M_bar = np.ones(robot.n)
    controller = HIMPC(robot, Settings(stack, tuple(M_bar), horizon=3))
    q, v, turn = rng.uniform(-2, 2, robot.n), rng.normal(size=robot.n), pin.exp3(2 * rng.normal(size=3))
    references = {"position": Hold(np.zeros(3)), "orientation": Hold(turn), "posture": Hold(robot.home)}
    plan = controller.step(q, v, {name: each.preview(0.0, 1e-3, 3) for name, each in references.items()})
    data, tip = robot.model.createData(), robot.frame_id("tip")
    J = pin.computeFrameJacobian(robot.model, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
    place = pin.updateFramePlacement(robot.model, data, tip)
    np.testing.assert_allclose(plan.values["position"], place.translation, atol=1e-12)
    np.testing.assert_allclose(plan.values["orientation"], place.rotation, atol=1e-12)
    assert isinstance(controller.kernel, CompiledTick)
    np.testing.assert_allclose(controller.kernel.arena.f["B"][0, :6], J, atol=1e-12)
    away = pin.log3(place.rotation @ turn.T)
    if np.linalg.norm(away) < np.pi - 0.02:  # Pinocchio's own formula is inaccurate near π
        np.testing.assert_allclose(plan.errors["orientation"], away, atol=1e-12)
    np.testing.assert_allclose(pin.exp3(plan.errors["orientation"]), place.rotation @ turn.T, atol=1e-12)


# ------------------------------------------------------------------ the same torques


def a_tick_later(hierarchy: Hierarchy, seed: int) -> Hierarchy:
    rng = np.random.default_rng(seed)
    return Hierarchy(
        [shifted(p, rng.normal(0, 1e-3, p.free.shape)) for p in hierarchy.problems], hierarchy.rows
    )


@given(seeds, st.integers(2, 9), st.integers(1, 8), st.integers(1, 4), st.sampled_from([1.0, 5.0, 30.0]))
@settings(max_examples=150)
def test_the_next_tick_has_the_printed_optimum(seed: int, n: int, N: int, levels: int, room: float) -> None:
    """Started with the active rows of the previous tick, the optimum satisfies the literal KKT conditions and
    agrees with the printed equations."""
    hierarchy = random_hierarchy(seed, n, N, levels, room=room, even=True)
    before = {solution.name: solution for solution in hierarchy.solve()}
    later = a_tick_later(hierarchy, seed)
    solutions = later.solve(previous=before)
    assert_sound(later, solutions)
    assert off(solutions, exact_increments(later, solutions, later.solve("printed"))) <= 1e-7


@pytest.mark.parametrize("seed", range(20))
def test_the_optimum_does_not_depend_on_where_it_started(seed: int) -> None:
    """The increments are the same when the solver starts with the active rows of the previous tick, with
    none, or with multipliers of the wrong sign."""
    hierarchy = random_hierarchy(seed, 7, 6, 3, even=True)
    cold = hierarchy.solve()
    warm = {solution.name: solution for solution in cold}
    wrong = {
        name: each._replace(active=replace(each.active, multiplier=-each.active.multiplier))
        for name, each in warm.items()
    }
    for previous in (warm, wrong):
        assert_agree(hierarchy.solve(previous=previous), cold, 1e-7)


@pytest.mark.parametrize("law", ["uniform", "eased"])
@given(seeds)
@settings(max_examples=20)
def test_the_kernel_s_references_are_the_printed_ones(law: Literal["uniform", "eased"], seed: int) -> None:
    """A curve that the kernel evaluates agrees with the preview of its reference, at all times, phases and
    periods."""
    rng = np.random.default_rng(seed)
    robot = load_robot("planar3")
    stack = (Level((FramePosition(name="position", axes="xy"),)), Level((Posture(name="posture"),)))
    phase = Phase(float(rng.normal(0, 3)), law, float(rng.normal()))
    u, w, c = rng.normal(size=(3, 2))
    given_: dict[str, Reference] = {
        "position": (Circle if seed % 2 else FigureEight)(c, u, w, phase),
        "posture": Sinusoid(robot.home, rng.normal(size=3), phase) if seed % 3 else Hold(robot.home),
    }
    N = int(rng.integers(1, 12))
    controller = HIMPC(robot, Settings(stack, (1.0, 1.0, 1.0), horizon=N, T_s=0.002))
    assert isinstance(controller.kernel, CompiledTick)
    outlook = Outlook(given_, float(rng.uniform(0, 20)), 0.002, N)
    controller.step(robot.home, np.zeros(3), outlook)
    f = controller.kernel.arena.f
    for name, span in (("position", slice(0, 2)), ("posture", slice(2, 5))):
        preview = given_[name].preview(outlook.t, 0.002, N)
        np.testing.assert_allclose(f["x_d"][span], preview.value, atol=1e-12)
        for found, wanted in zip(f["motion"][:, :, span], preview[1:], strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-10)
