"""In the exercise of the distance row, `now.near` contains what is documented, and the mistakes are
distinguished."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from right_laws import DISTANCE
from submissions import MISTAKES

from himpc.controllers import viewer
from himpc.controllers.own import OwnController
from himpc.controllers.view import View
from lessons.exercises import load_exercise
from lessons.exercises.inside.now import numbers_of, rebuilt, shape_of
from lessons.exercises.mistakes import Diagnosis, Law
from lessons.own.files import Source, execute
from lessons.own.kinds import law_of
from lessons.scenes.catalog import as_torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.torque import TorqueSession
from lessons.settings.torque import TorqueSettings
from robots import Robot

EXERCISE = load_exercise("distance-row")
RIGHT = law_of(execute(Source("right.py", DISTANCE)))()


def seen_by(views: list[View], law: Law, settings: TorqueSettings, robot: Robot) -> OwnController:
    """Returns a controller that runs a law and stores every view that the law receives."""

    def call(law: Law, view: View) -> object:
        views.append(view)
        return law(view)

    return OwnController(robot, settings.for_controller(), lambda: law, call, "here")


def seen(law: Law) -> list[View]:
    """Returns the views that a law receives while the robot passes the post."""
    found: list[View] = []
    (past,) = (check for check in EXERCISE.checks(0) if "past the post" in check.text)
    scene = as_torque_scene(past.run.prepared(), "it")
    session = TorqueSession(scene, controllers=partial(seen_by, found, law))
    while session.t < scene.duration - 1e-9:
        session.tick()
    assert session.failure is None
    return found


@pytest.fixture(scope="module")
def views() -> list[View]:
    """The views that the right solution receives."""
    return seen(RIGHT)


def test_a_known_mistake_of_the_distance_row_is_named_and_a_right_row_is_not(views: list[View]) -> None:
    """Each mistake is recognised by its torques at the views of a right solution and of a solution without
    rows."""
    blind = next(each for each in EXERCISE.mistakes if "no pair" in each.says).make()
    chosen = [*views[::20], *seen(blind)[::20]]
    told = []
    for law in (RIGHT, *(each.make() for each in EXERCISE.mistakes)):
        diagnosis = Diagnosis(EXERCISE.mistakes)
        for now in chosen:
            diagnosis.begin()
            diagnosis.see(now, law(now))
        told.append(diagnosis.says)
    assert told == ["", *(each.says for each in EXERCISE.mistakes)]


def test_every_check_of_the_distance_row_is_failed_by_a_mistake() -> None:
    """Each mistake names the check that it must fail; another test of all mistakes verifies that it does."""
    named = [each.fails for each in MISTAKES["distance-row"].values() if each.fails]
    for check in EXERCISE.checks(0):
        assert any(words in check.text for words in named), check.text


def test_near_is_sent_to_a_submission_as_it_is(views: list[View]) -> None:
    now = max(views, key=lambda each: len(each.near.d))
    assert len(now.near.d) == 7
    data = b"".join(each.tobytes() for each in numbers_of(now))
    again = rebuilt(shape_of(now), data, lambda *_: now.M)
    for name, value in vars(now.near).items():
        assert np.array_equal(value, getattr(again.near, name)), name


def test_the_gradient_of_near_is_how_fast_its_distances_change(views: list[View]) -> None:
    pairs = [(was, now) for was, now in pairwise(views) if was.near.names == now.near.names]
    assert len(pairs) > 100
    T_s = views[0].T_s
    for was, now in pairs:
        told = 0.5 * (was.near.gradient @ was.q_dot + now.near.gradient @ now.q_dot)
        assert (now.near.d - was.near.d) / T_s == pytest.approx(told, abs=0.02)
    fast = max(abs(was.near.gradient @ was.q_dot).max() for was, _ in pairs)
    assert fast > 0.3


def test_near_is_empty_and_costs_nothing_unless_distances_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("no distance is asked for")

    monkeypatch.setattr(viewer, "Distances", refused)
    found: list[View] = []
    off = as_torque_scene(RunSpec("iiwa14-table").but("avoidance.on=false").prepared(), "it")
    TorqueSession(off, controllers=partial(seen_by, found, RIGHT)).tick()
    near = found[0].near
    assert (near.names, near.d.shape, near.gradient.shape) == ((), (0,), (0, 7))
