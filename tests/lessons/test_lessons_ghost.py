"""A ghost repeats the script of its leader, tick by tick and bitwise."""

from __future__ import annotations

import numpy as np
import pytest

from lessons.events import Event, MoveLevel, MoveTarget, Push, Reset, Set
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.ghost import GhostDriver, ghost_scene, swapped
from lessons.session.torque import TorqueSession
from robots import InputError


@pytest.fixture(scope="module")
def scene() -> TorqueScene:
    return torque_scene("iiwa14-hold")


class Pair:
    """A leader that receives events, and a ghost that receives only the log of the leader."""

    def __init__(self, scene: TorqueScene, *own: str) -> None:
        self.leader = TorqueSession(scene)
        other = ghost_scene(scene, scene.settings, own)
        assert isinstance(other, TorqueScene)
        session = TorqueSession(other)
        self.ghost = GhostDriver(session, scene.settings, own)
        self.rows: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        self._told = 0

    def lead(self, ticks: int) -> None:
        self.rows[0].extend(self.leader.tick().copy() for _ in range(ticks))

    def tell(self) -> None:
        log = self.leader.log
        self.ghost.hear(log[self._told :], self.leader.t)
        self._told = len(log)

    def follow(self) -> None:
        self.tell()
        while self.ghost.due:
            self.step()

    def step(self) -> None:
        self.rows[1].append(self.ghost.session.tick().copy())
        self.ghost.take()

    def post(self, *events: Event) -> None:
        for event in events:
            self.leader.post(event)

    def compare(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the rows of both, with zeros in place of the measured times."""
        timed = [self.leader.layout.fields["step_us"]]
        timed += [self.leader.layout.fields[f"time_us/{name}"] for name in self.leader.layout.levels]
        both = tuple(np.array(rows) for rows in self.rows)
        for rows in both:
            for field in timed:
                rows[:, field] = 0.0
        return both[0], both[1]


def hand(pair: Pair) -> np.ndarray:
    return pair.leader.plant.frame_pose(pair.leader.robot.tip)[1]


def test_equal_settings_give_equal_rows_whatever_happens(scene: TorqueScene) -> None:
    """Events of every kind at arbitrary times reach the ghost in groups of different sizes, also during
    pauses."""
    pair = Pair(scene)
    rng = np.random.default_rng(3)
    target = tuple(hand(pair) + np.array([0.02, 0.08, -0.03]))
    script: tuple[tuple[Event, ...], ...] = (
        (MoveTarget("position", target),),
        (Push(scene.robot.joint_names[4], (0.0, 25.0, 0.0), seconds=0.013), Set("horizon", 3)),
        (Set("horizon", 3),),
        (MoveLevel("posture", 1), Set("levels.posture.Q", 40.0)),
        (Set("plant.payload_kg", 2.0), Set("controller", "hqp")),
        (Set("controller", "himpc"), Set("levels.orientation.enabled", False)),
        (Reset(), MoveTarget("position", target)),
        (Set("T_s", 0.0005), Set("M_bar_scale", 1.3)),
    )
    for events in script:
        if any(isinstance(event, Reset) for event in events):
            pair.follow()  # otherwise the ghost would skip rows before a reset
        pair.post(*events)
        if rng.random() < 0.5:
            pair.leader.drain()  # posted during a pause, so it takes effect before the next tick
            pair.tell()
        pair.lead(int(rng.integers(1, 60)))
        pair.follow()
        pair.lead(int(rng.integers(1, 30)))
    pair.follow()
    led, followed = pair.compare()
    assert len(led) > 200 and pair.leader.log and not pair.leader.notices
    assert np.array_equal(led, followed, equal_nan=True)
    assert pair.ghost.session.settings == pair.leader.settings and pair.ghost.behind == 0.0


def test_what_makes_the_difference_stays_and_all_else_carries_over(scene: TorqueScene) -> None:
    pair = Pair(scene, "controller=weighted", "levels.position.Q=50")
    for event in (
        Set("controller", "osf"),
        Set("levels.position.Q", 300.0),
        Set("Q", 120.0),
        Set("horizon", 4),
        MoveLevel("position", 2),
    ):
        pair.post(event)
        pair.lead(3)
        pair.follow()
    own, leader = pair.ghost.session.settings, pair.leader.settings
    assert own.controller == "weighted" and leader.controller == "osf"
    Q = {level.name: level.Q for level in own.levels}
    assert Q == {"position": 50, "orientation": 120, "posture": 120}
    assert own.horizon == 4 and [level.name for level in own.levels] == [
        level.name for level in leader.levels
    ]
    assert pair.ghost.session.t == pair.leader.t


def test_a_change_of_the_difference_itself_is_not_even_noticed(scene: TorqueScene) -> None:
    """The leader changes N; a ghost that has its own N is not affected."""
    moved, left = Pair(scene, "horizon=2"), Pair(scene, "horizon=2")
    for N in (7, 9, 3):
        moved.post(Set("horizon", N))
        for pair in (moved, left):
            pair.lead(5)
            pair.follow()
    assert np.array_equal(moved.compare()[1], left.compare()[1], equal_nan=True)


def test_another_period_runs_to_the_same_time_and_takes_events_then(scene: TorqueScene) -> None:
    pair = Pair(scene, "T_s=0.002")
    pair.lead(7)
    pair.post(Push(scene.robot.joint_names[3], (0.0, 40.0, 0.0), seconds=0.01))
    pair.lead(8)
    pair.follow()
    assert pair.ghost.session.t == pytest.approx(0.014)
    assert [t for t, _ in pair.ghost.session.log] == pytest.approx([0.008])
    pair.lead(1)
    pair.follow()
    assert pair.ghost.session.t == pytest.approx(0.016) and pair.ghost.behind == 0.0


def test_it_never_runs_ahead_and_a_reset_brings_it_back_at_once(scene: TorqueScene) -> None:
    pair = Pair(scene)
    assert not pair.ghost.due
    pair.lead(50)
    pair.tell()
    assert pair.ghost.behind == pytest.approx(0.05)
    for _ in range(10):
        assert pair.ghost.due
        pair.step()
    pair.post(Set("horizon", 8), Reset())
    pair.lead(4)
    pair.follow()
    assert len(pair.rows[1]) == 14 and pair.ghost.session.settings.horizon == 8
    led, followed = pair.compare()
    assert np.array_equal(led[-4:], followed[-4:], equal_nan=True)


def test_own_settings_that_do_not_fit_are_refused(scene: TorqueScene) -> None:
    with pytest.raises(InputError, match="horizon"):
        ghost_scene(scene, scene.settings, ("horizn=3",))


def test_changing_sides_gives_each_what_the_other_had(scene: TorqueScene) -> None:
    own = ("controller=hqp", "levels.position.Q=50", "plant.payload_kg=2")
    kept, events = swapped(scene.settings, own)
    assert kept == ("controller=himpc", "levels.position.Q=200.0", "plant.payload_kg=0.0")
    session = TorqueSession(scene)
    for event in events:
        session.post(event)
    session.drain()
    other = ghost_scene(scene, scene.settings, own).settings
    assert session.settings == other and not session.notices
    assert ghost_scene(scene, session.settings, kept).settings == scene.settings
    with pytest.raises(InputError, match="level"):
        swapped(scene.settings, ("levels.position.K_p=3",))
