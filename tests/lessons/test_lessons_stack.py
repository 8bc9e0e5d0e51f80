"""The stack is a setting: it can be read, exported, changed in part, and changed while the robot moves."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc.tasks import KINDS, Damping, FramePosition, Posture
from lessons.events import MoveTarget, Reset, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.replay.script import script
from lessons.replay.state import decode, encode, state_of
from lessons.scenes.catalog import prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import differences, with_assignments
from lessons.settings.torque import TorqueSettings
from robots import InputError

Array = NDArray[np.float64]
SCENE = torque_scene("iiwa14-hold")
START = SCENE.settings
EVERY_KIND = [
    {"task": "position", "frame": "flange", "axes": "xy", "Q": 100},
    [{"task": "orientation", "name": "turn"}, {"task": "pointing", "frame": "link_4", "axis": "-y"}],
    {"tasks": [{"task": "com", "axes": "z"}, {"task": "plane_distance", "normal": [1, 0, 0]}], "horizon": 3},
    {"task": "relative_position", "root": "link_3", "axes": "z", "K_p": 30, "K_v": 9},
    {"task": "relative_orientation", "root": "link_3", "enabled": False},
    {"task": "joints", "joints": ["joint_1", "joint_2"]},
    {"task": "posture"},
]


def names(settings: TorqueSettings) -> list[str]:
    return [level.name for level in settings.levels]


# ------------------------------------------------------------------ reading and exporting


def test_a_stack_is_read_as_it_is_written() -> None:
    levels = START.changed("stack", EVERY_KIND).levels
    assert [len(level.tasks) for level in levels] == [1, 2, 2, 1, 1, 1, 1]
    assert [level.Q for level in levels[:2]] == [100.0, 200.0]
    assert levels[2].horizon == 3
    assert not levels[4].enabled
    assert isinstance(levels[0].tasks[0], FramePosition)
    assert levels[0].tasks[0].axes == "xy"
    assert isinstance(levels[6].tasks[0], Posture)
    # Missing gains are computed for the robot; a task that existed before keeps its own gains.
    assert levels[5].tasks[0].K_p == START.levels[0].tasks[0].K_p
    assert levels[3].tasks[0].K_p == 30.0


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_added_and_told(kind: str) -> None:
    settings = START.changed("stack.add", {"task": kind})
    assert isinstance(settings.levels[-1].tasks[0], Posture)
    again = with_assignments(START, differences(START, settings))
    assert again == settings
    assert len(settings.levels[-2].tasks) == len(KINDS[kind].makes)
    if kind == "damping":
        assert isinstance(settings.levels[-2].tasks[0], Damping)
        assert settings.levels[-2].tasks[0].K_p == 0.0


def test_a_told_stack_is_the_same_to_the_last_bit() -> None:
    """An exported stack is equal as assignments and as a state code, also together with other changed
    settings."""
    settings = START.changed("stack", EVERY_KIND).changed("tasks.turn.K_p", 0.1 + 0.2)
    settings = settings.changed("levels.posture.Q", [1, 2, 3, 4, 5, 6, 7]).changed(
        "order", names(settings)[::-1]
    )
    settings = settings.changed("controller", "hqp").changed("plant.payload_kg", 1.5)
    told = differences(START, settings)
    assert with_assignments(START, told) == settings
    state = state_of(RunSpec("iiwa14-hold"), settings)
    opened = decode(encode(state)).run.prepared().settings
    assert opened == settings


def test_an_unchanged_composition_is_told_as_before() -> None:
    settings = START.changed("order", names(START)[::-1]).changed("levels.posture.Q", 7)
    assert not any(each.startswith("stack=") for each in differences(START, settings))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ([], "give a list of levels"),
        ("position", "give a list of levels"),
        ([{"task": "positon"}], "did you mean 'position'"),
        ([{"frame": "flange"}], "There is no kind of task"),
        ([{"task": "position", "axes": "w"}], "x, y and z"),
        ([{"task": "position", "axis": "x"}], "did you mean 'axes'"),
        ([{"task": "pointing", "axis": "q"}], "Choose one of x, y, z"),
        ([{"task": "position", "name": "a.b"}], "name of a task"),
        ([{"task": "position", "name": "7"}], "name of a task"),
        ([{"task": "position", "name": "damping"}], "last level"),
        ([{"task": "position"}, {"task": "posture", "name": "position"}], "twice"),
        ([{"task": "position", "Q": -1}], "from 1e-12"),
        ([{"task": "position", "K_p": "stiff"}], "K_p"),
        ([{"tasks": []}], "as a list"),
        ([7], "as an object"),
        ([{"task": "posture"}] * 21, "at most 20"),
        ([[{"task": "posture"}] * 15, [{"task": "position"}] * 15], "at most 20"),
    ],
)
def test_a_wrong_stack_is_one_sentence(value: Any, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        START.changed("stack", value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ({"task": "position", "frame": "flnge"}, "did you mean 'flange'"),
        ({"task": "relative_position", "root": "lnk_3"}, "did you mean 'link_3'"),
        ({"task": "joints", "joints": ["joint_9"]}, "Choose one of joint_1"),
    ],
)
def test_what_the_robot_does_not_have_is_one_sentence_and_changes_nothing(task: dict, words: str) -> None:
    """A task that the robot cannot have is refused in a prepared scene and in a running session."""
    wrong = START.changed("stack.add", task)
    with pytest.raises(InputError, match=words):
        TorqueSession(replace(SCENE, settings=wrong))
    session = TorqueSession(SCENE)
    session.tick()
    layout = session.layout
    session.post(Set("stack.add", task))
    session.tick()
    assert words.split("'")[-2 if "'" in words else 0] in session.notices[0]
    assert session.layout is layout
    assert session.settings.levels == START.levels


# ------------------------------------------------------------------ changes


def test_the_stack_is_changed_in_part() -> None:
    settings = START.changed(
        "stack.add", {"task": "position", "name": "elbow", "frame": "link_4", "level": 2}
    )
    assert names(settings) == ["position", "elbow", "orientation", "posture"]
    settings = settings.changed("stack.edit", {"name": "elbow", "axes": "y"})
    assert settings.levels[1].tasks[0].coordinates(SCENE.robot) == ("y",)
    settings = settings.changed("stack.rename", ["elbow", "knee"])
    settings = settings.changed("stack.merge", ["knee", "orientation"])
    assert names(settings) == ["position", "orientation+knee", "posture"]
    settings = settings.changed("stack.split", "knee")
    assert names(settings) == ["position", "orientation", "knee", "posture"]
    settings = settings.changed("stack.add", {"task": "com", "with": "posture"})
    assert names(settings)[-1] == "posture+com"
    settings = settings.changed("stack.remove", "com").changed("stack.remove", "knee")
    assert settings == START


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("stack.add", {"task": "com", "level": 9}, "from 1 to 4"),
        ("stack.add", {"task": "com", "with": "elbow"}, "no level 'elbow'"),
        ("stack.add", 3, "as an object"),
        ("stack.remove", "elbow", "no task 'elbow'"),
        ("stack.rename", ["position", "posture"], "twice"),
        ("stack.rename", "position", "OLD, NEW"),
        ("stack.edit", {"name": "position", "colour": "red"}, "Choose one of"),
        ("stack.split", "position", "level of its own"),
        ("stack.merge", ["position", "position"], "itself"),
        ("stack.merge", ["position"], "two levels"),
    ],
)
def test_a_wrong_change_is_one_sentence(path: str, value: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        START.changed(path, value)


def test_the_last_task_stays() -> None:
    settings = START.changed("stack", [{"task": "posture"}])
    with pytest.raises(InputError, match="the last one"):
        settings.changed("stack.remove", "posture")


# ------------------------------------------------------------------ while the robot moves

CHANGES = (
    Set("stack.add", {"task": "position", "name": "elbow", "frame": "link_4", "level": 2}),
    MoveTarget("position", (0.55, 0.1, 0.5)),
    Set("stack.edit", {"name": "elbow", "axes": "yz"}),
    Set("stack.merge", ["elbow", "orientation"]),
    Set("stack.rename", ["elbow", "knee"]),
    Set("stack.split", "knee"),
    Set("stack.add", {"task": "pointing", "frame": "link_6", "with": "posture"}),
    Set("stack.remove", "knee"),
    Set("stack", [{"task": "relative_pose", "root": "link_2"}, {"task": "com"}]),
    Set("stack", [{"task": "position"}, {"task": "orientation"}, {"task": "posture"}]),
)


@pytest.mark.parametrize("controller", ["himpc", "hqp", "tdeosf", "weighted"])
def test_the_stack_changes_without_a_bump(controller: str) -> None:
    """With a change every 60 ms while the arm moves, all numbers stay finite, no torque jumps by 6 N·m or
    more in one tick, and no joint is faster than 1.1 times its velocity limit."""
    scene = replace(SCENE, settings=START.changed("controller", controller))
    session = TorqueSession(scene)
    steps, worst = [], 0.0
    tau = session.plant.tau.copy()
    for tick in range(60 * (len(CHANGES) + 3)):
        if tick % 60 == 30 and tick // 60 < len(CHANGES):
            session.post(CHANGES[tick // 60])
        row = session.tick()
        fields = session.layout.fields
        now = row[fields["tau"]].copy()
        assert np.isfinite(now).all()
        assert np.isfinite(row[fields["q"]]).all()
        for task in session.layout.tasks:
            for field in ("error", "x", "x_d", "v_d", "a_d"):
                assert np.isfinite(row[fields[f"{field}/{task.name}"]]).all(), (tick, task.name, field)
        steps.append(np.abs(now - tau).max())
        worst = max(worst, float(np.abs(row[fields["v"]] / session.robot.v_limit).max()))
        tau = now
    assert session.notices == []
    assert max(steps) < 6.0
    assert worst < 1.1


def test_a_target_stays_where_the_hand_put_it() -> None:
    """The target keeps its coordinates along the axes that remain. Along a new axis it starts at the position
    of the robot. A renamed task keeps its target."""
    session = TorqueSession(SCENE)
    session.post(MoveTarget("position", (0.6, 0.1, 0.5)))
    for _ in range(50):
        session.tick()
    session.post(Set("stack.edit", {"name": "position", "axes": "zx"}))
    session.post(Set("stack.rename", ["position", "hand"]))
    session.tick()
    target = session.target("hand")
    assert target is not None
    np.testing.assert_allclose(target.raw, [0.5, 0.6])
    session.post(Set("stack.edit", {"name": "hand", "axes": "xyz"}))
    session.tick()
    target, row = session.target("hand"), session.tick()
    assert target is not None
    np.testing.assert_allclose(target.raw[[0, 2]], [0.6, 0.5])
    x = row[session.layout.fields["x/hand"]]
    assert abs(target.raw[1] - x[1]) < 5e-3


def test_a_scene_s_motion_is_for_the_coordinates_it_was_made_for() -> None:
    """If the task of the circle has fewer axes, it has a target instead of the motion; with the same axes the
    motion continues."""
    circle = torque_scene("iiwa14-circle")
    session = TorqueSession(circle)
    session.post(Set("stack.add", {"task": "com", "level": 3}))
    session.tick()
    assert session.target("position") is None
    session.post(Set("stack.edit", {"name": "position", "axes": "xz"}))
    session.tick()
    assert session.target("position") is not None
    session.post(Reset())
    session.tick()
    assert session.target("position") is not None
    assert session.notices == []


def test_ranks_tell_which_level_gets_what() -> None:
    """With seven joints and 3 + 3 + 3 + 7 rows, the elbow has rank 1, the only direction that remains."""
    settings = START.changed("stack.add", {"task": "position", "name": "elbow", "frame": "link_4"})
    found = summary(run(replace(SCENE, settings=settings), 0.01))["levels"]
    assert [(each["name"], each["rank"], each["rows"]) for each in found] == [
        ("position", 3, 3),
        ("orientation", 3, 3),
        ("elbow", 1, 3),
        ("posture", 0, 7),
    ]
    json.dumps(found)


def test_a_run_with_changes_is_repeated_by_its_script(tmp_path: Any) -> None:
    """The exported script applies the same changes at the same ticks; a task has NaN in the rows before it
    existed."""
    session = TorqueSession(SCENE)
    rows = []
    for tick in range(40):
        if tick % 5 == 0 and tick // 5 < len(CHANGES):
            session.post(CHANGES[tick // 5])
        rows.append(session.tick()[session.layout.fields["tau"]].copy())
    text = script(RunSpec("iiwa14-hold"), session.log, session.t)
    space: dict[str, Any] = {"__name__": "script"}
    exec(compile(text.split("\nprint(")[0], "script", "exec"), space)
    np.testing.assert_array_equal(space["recording"]["tau"], np.array(rows))
    assert np.isnan(space["recording"]["error/pointing"][0]).all()
    assert np.isfinite(space["recording"]["error/position"]).all()


def test_gains_of_a_new_task_are_paths_of_a_sweep() -> None:
    text = (
        'stack=[{"task":"position"},{"task":"position","name":"elbow","frame":"link_4"},{"task":"posture"}]'
    )
    scene = prepared(SCENE, None, [text, "tasks.elbow.K_p=50", "levels.elbow.Q=20"])
    assert scene.settings.levels[1].tasks[0].K_p == 50.0
    assert scene.settings.levels[1].Q == 20.0
