"""The picture of a tick's QPs agrees with the solver's results."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from himpc.cascade.level import LevelProblem
from himpc.kinematics.configuration import Configuration
from himpc.limits import TORQUE, Rows
from himpc.qp import solve_qp
from lessons.events import MoveLevel, MoveTarget, Set
from lessons.geometry.ellipsoids import ellipsoids
from lessons.geometry.look import plane_of, tick_of
from lessons.geometry.plane import Allowed, Plane, TorqueBox, best, cut
from lessons.scenes.catalog import prepared, torque_scene
from lessons.session.torque import TorqueSession
from robots import InputError

JOINTS = (0, 1)
WITHOUT = TorqueBox(np.full(2, -np.inf), np.full(2, np.inf), ((None, None), (None, None)))


def running(
    *assignments: str, ticks: int = 30, by: float = 0.1, scene: str = "planar3-plane"
) -> TorqueSession:
    """Returns a session in the middle of a motion that began when its target was dragged aside."""
    session = TorqueSession(prepared(torque_scene(scene), None, assignments))
    name = session.layout.tasks[0].name
    target = session.target(name)
    assert target is not None
    at = np.array(target.raw)
    at[0] += by
    session.post(MoveTarget(name, tuple(at.tolist())))
    for _ in range(ticks):
        session.advance()
    return session


def points(plane: Plane) -> list[np.ndarray]:
    return [level.solved for level in plane.levels]


@pytest.mark.parametrize("assignments", [(), ("limits.torque_scale=0.02",), ("controller=himpc_printed",)])
def test_geometry_and_solver_find_the_same_points(assignments: tuple[str, ...]) -> None:
    session = running(*assignments, ticks=60)
    for _ in range(100):
        session.advance()
        plane = plane_of(session, JOINTS, "applied")
        assert plane.apart < 1e-6
        _, second, third = plane.levels
        assert max(level.apart for level in plane.levels) < 1e-9
        # Only level 3 uses joint 3, and the result of levels 1 and 2 is applied.
        assert np.allclose(second.solved, third.solved, atol=1e-9)
        assert [level.name for level in plane.levels] == ["reach", "pose", "wrist"]


@pytest.mark.parametrize(
    ("scene", "horizon"), [("planar3-hold", 1), ("iiwa14-hold", 1), ("planar3-circle", 1)]
)
def test_each_level_is_best_in_the_cut_through_its_own_solution(scene: str, horizon: int) -> None:
    """In the plane of two joints, with the other joints at the solution of the level, this solution is
    optimal."""
    session = TorqueSession(prepared(torque_scene(scene), None, (f"horizon={horizon}",)))
    for _ in range(200):
        session.advance()
    tick = tick_of(session)
    for level in tick.strict:
        found = next(each for each in plane_of(session, (0, 2), level.name).levels if each.name == level.name)
        assert found.apart == 0.0 and found.optimum is not None
        assert np.allclose(found.optimum, found.solved, atol=1e-6)


def test_the_cost_is_the_solvers() -> None:
    """The cost of a level at a point of the plane is the cost of its problem, (32a) or (34a), also for a
    horizon with more than one knot. The ellipse through the point has this cost."""
    session = running("horizon=4", scene="iiwa14-hold")
    tick = tick_of(session)
    held = np.array(tick.strict[-1].U)
    plane = cut(tick.problems, tick.plan.rows, [each.U for each in tick.strict], (1, 3), held)
    rng = np.random.default_rng(3)
    for problem, level in zip(tick.problems, plane.levels, strict=True):
        for w in rng.uniform(-1.0, 1.0, (5, 2)):
            U = held.copy()
            U[0, [1, 3]] = w
            assert level.cost(w) == pytest.approx(problem.cost(U), rel=1e-9)
            long, short, angle = level.ellipse(w)
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            local = turn.T @ (w - level.centre)
            assert (local[0] / long) ** 2 + (local[1] / short) ** 2 == pytest.approx(1.0, rel=1e-6)


def test_the_box_is_where_the_rows_hold() -> None:
    session = running("limits.position=paper", "horizon=3", scene="planar3-hold")
    tick = tick_of(session)
    held = np.array(tick.strict[-1].U)
    rows = tick.plan.rows
    box = cut(tick.problems, rows, [each.U for each in tick.strict], (0, 2), held).box
    for w in np.random.default_rng(1).uniform(-8.0, 8.0, (200, 2)):
        U = held.copy()
        U[0, [0, 2]] = w
        value = (rows.L @ U)[:, [0, 2]]
        holds = (rows.lower[:, [0, 2]] <= value).all() and (value <= rows.upper[:, [0, 2]]).all()
        assert holds == box.inside(w)


def test_dragging_moves_both_optima_and_the_line() -> None:
    one, other = (plane_of(running(by=by), JOINTS, "applied") for by in (0.1, -0.1))
    for place in (0, 1):
        assert np.linalg.norm(one.levels[place].solved - other.levels[place].solved) > 0.01
    line = one.levels[1].allowed
    assert line.span.shape == (2, 1) and one.levels[0].allowed.span.shape == (2, 2)
    assert line.at is not None
    away = one.levels[1].solved - line.at
    assert np.abs(away - line.span[:, 0] * (line.span[:, 0] @ away)).max() < 1e-9  # level 2 is on the line


def test_swapping_levels_swaps_their_roles() -> None:
    session = running(ticks=400)
    before = plane_of(session, JOINTS, "applied")
    session.post(MoveLevel("pose", 0))
    session.advance()
    after = plane_of(session, JOINTS, "applied")
    assert [level.name for level in after.levels[:2]] == ["pose", "reach"]
    pose, reach = after.levels[:2]
    assert np.allclose(pose.solved, pose.centre, atol=1e-6)  # level 1 has its lowest cost
    assert reach.allowed.span.shape == (2, 0)  # with two coordinates, only a point is left
    assert np.allclose(reach.solved, pose.solved, atol=1e-6)
    was = before.levels[1]
    assert np.linalg.norm(was.solved - was.centre) > 0.05
    assert after.apart < 1e-6


def test_a_torque_bound_cuts() -> None:
    """Level 2 would move further in the directions that level 1 leaves free, but the bound stops it. Level 1
    is not affected."""
    free, tight = (
        plane_of(running(*set_, ticks=150), JOINTS, "applied") for set_ in ((), ("limits.torque_scale=0.01",))
    )
    assert free.box.kinds == (("velocity", "velocity"),) * 2
    assert tight.box.kinds == (("torque", "torque"),) * 2
    for plane, cuts in ((free, False), (tight, True)):
        first, second = plane.levels[:2]
        wanted = best(second.P, second.centre, second.allowed, WITHOUT)
        assert wanted is not None and plane.apart < 1e-6
        assert plane.box.inside(wanted) != cuts
        assert np.allclose(second.solved, wanted, atol=1e-6) != cuts
        assert plane.box.inside(second.solved, 1e-9) and plane.box.inside(first.centre, 1e-6)
    assert tight.levels[1].solved[0] == pytest.approx(tight.box.upper[0], abs=1e-9)
    assert tight.osf is not None and not tight.box.inside(tight.osf, 0.01)


def test_what_one_cost_of_all_would_ask_for_is_what_weighted_asks_for() -> None:
    session = running(ticks=400)
    guess = plane_of(session, JOINTS, "applied").weighted
    session = running("controller=weighted", ticks=400)
    plane = plane_of(session, JOINTS, "applied")
    assert plane.weighted is not None and session.plan is not None and guess is not None
    assert np.allclose(plane.weighted, session.plan.levels[-1].U[0, :2])
    assert plane.apart < 1e-6  # the solution of the strict hierarchy in the same tick
    strict = plane.levels[1]
    assert np.linalg.norm(plane.weighted - strict.solved) > 1e-4


def test_a_controller_without_such_a_qp_says_so() -> None:
    session = running("controller=osf")
    with pytest.raises(InputError, match="choose himpc"):
        plane_of(session, JOINTS, "applied")
    fresh = TorqueSession(torque_scene("planar3-plane"))
    with pytest.raises(InputError, match="No QP was solved yet"):
        plane_of(fresh, JOINTS, "applied")
    fresh.advance()
    fresh.post(Set("horizon", 2))
    fresh.drain()
    with pytest.raises(InputError):  # the problem with the new settings has not been solved yet
        plane_of(fresh, JOINTS, "applied")


def test_best_agrees_with_a_solver_on_random_problems() -> None:
    rng = np.random.default_rng(8)
    for _ in range(200):
        root = rng.normal(size=(2, 2))
        P, centre = root @ root.T + 0.05 * np.eye(2), rng.normal(size=2) * 2
        lower = -rng.uniform(0.1, 1.0, 2)
        box = TorqueBox(lower, lower + rng.uniform(0.2, 2.0, 2), ((None, None), (None, None)))
        d = int(rng.integers(0, 3))
        at = rng.uniform(box.lower, box.upper)
        span = np.linalg.qr(rng.normal(size=(2, 2)))[0][:, :d]
        w = best(P, centre, Allowed(at, span), box)
        normal = np.eye(2) - span @ span.T
        rows = np.vstack([np.eye(2), normal])
        bound = normal @ at
        found = solve_qp(P, -P @ centre, rows, np.r_[box.lower, bound], np.r_[box.upper, bound])
        assert w is not None and found.solved
        assert np.allclose(w, found.x, atol=1e-6)


def test_what_cannot_be_is_nothing() -> None:
    box = TorqueBox(-np.ones(2), np.ones(2), ((None, None), (None, None)))
    outside = Allowed(np.array([3.0, 0.0]), np.array([[0.0], [1.0]]))
    assert outside.segment(box) is None and best(np.eye(2), np.zeros(2), outside, box) is None
    assert best(np.eye(2), np.zeros(2), Allowed(None, np.eye(2)), box) is None
    assert best(np.eye(2), np.zeros(2), Allowed(np.array([3.0, 0.0]), np.zeros((2, 0))), box) is None
    upside_down = replace(box, lower=np.array([2.0, 0.0]))
    assert best(np.eye(2), np.zeros(2), Allowed(np.zeros(2), np.eye(2)), upside_down) is None


def test_a_cut_that_misses_what_is_allowed_says_so() -> None:
    problem = LevelProblem(
        "a", np.array([[[0.0, 0.0, 1.0]]]), np.ones((1, 1, 1)), np.zeros((1, 1)), np.ones(1), np.ones(3), 1
    )
    rows = Rows(np.ones((1, 1)), -np.ones((1, 3)), np.ones((1, 3)), (TORQUE,))
    U = np.zeros((1, 3))
    assert cut([problem], rows, [U], (0, 1), U).levels[0].leaves.span.shape == (2, 2)
    shifted = np.array([[0.0, 0.0, 0.5]])
    assert cut([problem], rows, [U], (0, 1), shifted).levels[0].leaves.at is None


def test_ellipsoids_hold_every_velocity_that_is_left() -> None:
    """Joint velocities of unit length, projected on the null space of the levels above, are inside the
    ellipsoids and reach their boundary."""
    scene = torque_scene("iiwa14-hold")
    robot, stack = scene.robot, scene.settings.levels
    here = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    found = ellipsoids(here, stack)
    assert [(each.task, each.turns) for each in found] == [("position", False), ("orientation", True)]
    rng = np.random.default_rng(4)
    speeds = rng.normal(size=(4000, robot.n))
    above = np.empty((0, robot.n))
    for level, each in zip(stack, found, strict=False):
        J = level.tasks[0].jacobian(here)[0]
        off = speeds - speeds @ np.linalg.pinv(above) @ above if len(above) else speeds
        moved = (off / np.linalg.norm(off, axis=1)[:, None]) @ J.T @ each.axes
        size = np.linalg.norm(moved / np.maximum(each.radii, 1e-12), axis=1)
        assert size.max() <= 1.0 + 1e-9 and size.max() > 0.97
        assert np.linalg.det(each.axes) == pytest.approx(1.0)
        above = np.vstack([above, J])


def test_a_straight_arm_has_a_flat_ellipsoid_and_a_level_without_freedom_none() -> None:
    robot = torque_scene("planar3-hold").robot
    stack = torque_scene("planar3-hold").settings.levels
    straight = Configuration(robot, robot.model.createData(), np.zeros(3), np.zeros(3))
    position, orientation = ellipsoids(straight, stack)
    assert position.radii[0] > 0.5 and position.radii[1] == 0.0
    off = tuple(replace(level, enabled=level.name != "position") for level in stack)
    alone = ellipsoids(straight, off)
    assert [each.task for each in alone] == ["orientation"] and alone[0].radii[0] > orientation.radii[0]
