"""State codes contain all settings in a line of text. They are bitwise equal after decoding, and safe if the
sender is not trusted."""

from __future__ import annotations

import base64
import json
import shlex
import zlib
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from himpc.tasks import FramePosition
from lessons.events import Appear, Event, MoveLevel, Set
from lessons.recording.run import run
from lessons.replay.state import MAX_CODE, State, decode, encode, state_of
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import Scene, TorqueScene, VelocityScene
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession
from lessons.settings.assignments import differences
from lessons.settings.settings import settings_after
from lessons.settings.torque import TorqueSettings
from robots import InputError

find = cache(load_scene)

NUMBERS = st.one_of(
    st.integers(0, 30),
    st.floats(1e-6, 50.0),
    st.sampled_from([0.1, 1.0, 1e-3, 0.3]),
)
WORDS = st.sampled_from(
    ["himpc", "hiqp", "hqp", "htmpc", "htidkc", "paper", "proximal", "cost", "himpc_printed", "proxqp", "off"]
) | st.sampled_from(["acceleration", "viability", "servo", "single_task", "decoupled", "yes"])


def values(n: int) -> st.SearchStrategy[Any]:
    lists = st.sampled_from((2, 3, n)).flatmap(lambda k: st.lists(NUMBERS, min_size=k, max_size=k))
    return st.one_of(NUMBERS, st.booleans(), WORDS, st.none(), lists)


@st.composite
def events(draw: st.DrawFn, scene: Scene) -> Event:
    kind = draw(st.sampled_from(["Set", "Set", "Set", "Set", "MoveLevel", "order", "Appear", "moved"]))
    names = [level.name for level in scene.settings.levels]
    if kind == "MoveLevel":
        return MoveLevel(draw(st.sampled_from(names)), draw(st.integers(0, len(names) - 1)))
    if kind == "order":
        return Set("order", draw(st.permutations(names)))
    if kind == "Appear":
        centre = draw(st.tuples(NUMBERS, NUMBERS, NUMBERS))
        return Appear(draw(st.sampled_from(["visitor", "bin", "lamp"])), centre, draw(st.floats(0.1, 1.0)))
    if kind == "moved":
        place = draw(st.none() | st.tuples(NUMBERS, NUMBERS, NUMBERS).map(list))
        return Set(f"obstacles.{draw(st.sampled_from(['table', 'bin', 'visitor', 'floor']))}", place)
    return Set(draw(st.sampled_from(scene.settings.paths())), draw(values(scene.robot.n)))


@pytest.mark.parametrize(
    "name", ["iiwa14-hold", "planar3-conflict", "ridgeback-ur10-square", "ridgeback-ur10-cluttered"]
)
@given(data=st.data())
@settings(max_examples=60)
def test_any_setting_survives_its_code(name: str, data: st.DataObject) -> None:
    """Settings after random events are equal after encoding and decoding, also when written for the command
    line."""
    scene = find(name)
    reached = scene.settings
    for _ in range(data.draw(st.integers(0, 12))):
        try:
            reached = settings_after(reached, [data.draw(events(scene))])
        except InputError:
            continue
    seed = data.draw(st.integers(0, 2**40))
    state = State(
        RunSpec(name, set=differences(scene.settings, reached), seed=seed), lesson="two-tasks", step=2
    )
    assert decode(encode(state)) == state
    assert prepared(scene, None, decode(encode(state)).run.set).settings == reached
    words = shlex.split(state.run.command_line())
    assert words[:3] == ["himpc-lab", "run", name]
    told = [after for before, after in pairwise(words) if before == "--set"]
    controller = words[words.index("--controller") + 1] if "--controller" in words else None
    assert prepared(scene, controller, told).settings == reached


def test_a_code_says_only_what_differs() -> None:
    """The code of an unchanged scene has a few characters; a rate that the controller itself sets is not
    stored."""
    plain = state_of(RunSpec("iiwa14-hold"), find("iiwa14-hold").settings)
    assert plain.run.set == ()
    assert len(encode(plain)) < 50
    scene = find("ridgeback-ur10-square")
    assert state_of(RunSpec(scene.name), scene.settings.changed("controller", "htidkc")).run.set == (
        "controller=htidkc",
    )


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        (
            "planar3-conflict",
            ("order=q1,position", "plant.friction=[0.1,0.2,0.3]", "controller=hqp", "q1_amplitude_deg=-60.3"),
        ),
        (
            "ridgeback-ur10-drag",
            ("order=base,ee", "plant.position_noise=1e-4", "obstacles.a=[2,0,0.5,0.3]"),
        ),
    ],
)
def test_a_run_from_a_code_is_equal_to_the_last_bit(name: str, changes: tuple[str, ...]) -> None:
    scene = prepared(find(name), None, changes)
    state = state_of(RunSpec(name, seed=5), scene.settings)
    again = decode(encode(state))
    recording, repeated = run(scene, 0.4, 5), run(again.run.prepared(), 0.4, again.run.seed)
    for field in ("t", "q", "v", "tau"):
        np.testing.assert_array_equal(recording[field], repeated[field])
    assert np.abs(np.diff(recording["q"], axis=0)).max() > 0


GOOD = encode(State(RunSpec("planar3-hold", set=("horizon=7", "levels.position.Q=150.5"))))


def test_a_code_that_was_cut_or_changed_never_becomes_another_state() -> None:
    """Such a code is refused, except for changes of the few padding bits that carry no information."""
    refused = 0
    for place in range(len(GOOD)):
        with pytest.raises(InputError):
            decode(GOOD[:place])
        other = "A" if GOOD[place] != "A" else "B"
        try:
            assert decode(GOOD[:place] + other + GOOD[place + 1 :]) == decode(GOOD)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused >= len(GOOD) - 2
    # A mail program may break lines and add blanks.
    assert decode(f"  {GOOD[:20]}\n{GOOD[20:]} ") == decode(GOOD)


def packed(data: Any) -> str:
    text = data if isinstance(data, bytes) else json.dumps(data).encode()
    return "hl1-" + base64.urlsafe_b64encode(zlib.compress(text)).decode().rstrip("=")


BAD: dict[str, tuple[str, str]] = {
    "nothing": ("", "not a state code"),
    "words": ("give me a robot", "not a state code"),
    "a link": ("https://example.org/?state=" + GOOD, "not a state code"),
    "of the future": ("hl2" + GOOD[3:], "newer"),
    "of the past": ("hl0" + GOOD[3:], "format 0"),
    "too long": ("hl1-" + "A" * MAX_CODE, "characters"),
    "a bomb": (packed(b'{"s":"' + b"A" * 5_000_000 + b'"}'), "incomplete"),
    "no JSON": (packed(b"import os"), "incomplete"),
    "nested": (packed(b"[" * 50_000), "incomplete"),
    "a list": (packed([1, 2]), "does not contain a state"),
    "a stranger's key": (packed({"s": "planar3-hold", "x": 1}), "does not contain a state"),
    "NaN": (packed(b'{"s":"planar3-hold","n":NaN}'), "incomplete"),
    "no scene": (packed({}), "no scene"),
    "an unknown scene": (packed({"s": "planar4-hold"}), "planar3-hold"),
    "a scene that is no text": (packed({"s": ["planar3-hold"]}), "scene in the code"),
    "a file": (packed({"s": "hold", "r": "/etc/passwd"}), "may not open files"),
    "a file beside it": (packed({"s": "hold", "r": "arm.urdf"}), "may not open files"),
    "a tip that is no name": (packed({"s": "hold", "r": "panda", "t": "a\nb"}), "tip in the code"),
    "settings that are no list": (packed({"s": "planar3-hold", "a": "horizon=7"}), "list of settings"),
    "settings that are no text": (packed({"s": "planar3-hold", "a": [7]}), "list of settings"),
    "too many settings": (packed({"s": "planar3-hold", "a": ["horizon=7"] * 501}), "number or length"),
    "a long setting": (packed({"s": "planar3-hold", "a": ["Q=" + "1" * 5000]}), "number or length"),
    "a fraction of a seed": (packed({"s": "planar3-hold", "n": 1.5}), "seed"),
    "true as a seed": (packed({"s": "planar3-hold", "n": True}), "seed"),
    "a huge seed": (packed({"s": "planar3-hold", "n": 10**400}), "seed"),
    "an unknown lesson": (packed({"s": "planar3-hold", "l": "two-taks"}), "two-tasks"),
    "a step before the first": (packed({"s": "planar3-hold", "p": -1}), "step"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_codes_are_refused_in_one_sentence(case: str) -> None:
    code, says = BAD[case]
    with pytest.raises(InputError, match=says) as caught:
        decode(code)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400 + 40 * len(find("planar3-hold").settings.paths())


@pytest.mark.parametrize(
    "assignment",
    [
        "nothing=1",
        "horizon=" + "9" * 400,
        "horizon=__import__('os')",
        "levels.1.Q=" + "[" * 1500,
        "plant.payload_kg=1e999",
        "M_bar_scale=" + "1" * 1900,
        "levels.1.__class__=1",
        "plant.__init__=1",
        "order=position,position,posture",
        "=3",
        "horizon",
    ],
)
def test_settings_of_a_stranger_are_refused_when_prepared(assignment: str) -> None:
    """Names and numbers of a code are checked like those of --set, and each wrong one is answered by one
    sentence."""
    with pytest.raises(InputError) as caught:
        decode(packed({"s": "planar3-hold", "a": [assignment]})).run.prepared()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "assignment",
    [
        "rounds=1000000000",
        f"seats={[0] * 900}",
        "obstacles.x=[1,2]",
        "obstacles.x=[1,2,3,-1]",
        "obstacles.x=null",
    ],
)
def test_a_mission_of_a_stranger_cannot_fill_the_memory(assignment: str) -> None:
    with pytest.raises(InputError):
        decode(packed({"s": "ridgeback-ur10-delivery", "a": [assignment]})).run.prepared()


@dataclass(frozen=True, kw_only=True)
class OwnKind(FramePosition):
    """A kind of task that has no name in the catalog."""


def test_what_a_code_cannot_carry_is_said() -> None:
    with pytest.raises(InputError, match="from a file"):
        encode(State(RunSpec("hold", urdf="/home/me/arm.urdf")))
    with pytest.raises(InputError, match="too long"):
        encode(State(RunSpec("planar3-hold", set=tuple(f"M_bar.1={k}" for k in range(501)))))
    hold = find("planar3-hold")
    assert isinstance(hold, TorqueScene)
    first, *others = hold.settings.levels
    own = replace(first, tasks=(OwnKind(name="position"),))
    other = replace(hold.settings, stack=(own, *others))
    with pytest.raises(InputError, match="cannot be written"):
        state_of(RunSpec("planar3-hold"), other)


def test_the_command_line_is_quoted_for_a_shell() -> None:
    state = State(
        RunSpec("hold", urdf="my robot.urdf", tip="tool", set=("controller=hqp", "Q=[1,2,3]"), seed=3)
    )
    assert state.run.command_line() == (
        "himpc-lab run hold --urdf 'my robot.urdf' --tip tool --controller hqp --seed 3 --set 'Q=[1,2,3]'"
    )


def test_priorities_of_now_are_part_of_a_state() -> None:
    """At velocity level, priorities that a user swaps belong to the run; a state code contains them as
    well."""
    scene = find("ridgeback-ur10-drag")
    assert isinstance(scene, VelocityScene)
    session = VelocitySession(scene)
    session.tick()
    assert session.settings_now == scene.settings
    session.post(MoveLevel("base", 0))
    session.tick()
    state = state_of(RunSpec(scene.name), session.settings_now)
    assert state.run.set == ("order=base,ee",)
    again = VelocitySession(prepared(scene, None, decode(encode(state)).run.set))  # pyright: ignore[reportArgumentType]
    again.tick()
    assert [active.task.role for active in again.progress.window] == ["base", "ee"]
    assert again.settings_now == again.settings
    torque = TorqueSession(find("planar3-hold"))  # pyright: ignore[reportArgumentType]
    assert torque.settings_now is torque.settings


@pytest.mark.parametrize(
    ("before", "controller", "solver"),
    [
        (("route=structured",), "himpc", "daqp"),
        (("route=compiled",), "himpc", "daqp"),
        (("route=explicit",), "himpc_printed", "daqp"),
        (("route=explicit", "solver=proxqp"), "himpc_printed", "proxqp"),
        (("controller=weighted", "route=explicit", "solver=proxqp"), "weighted", "daqp"),
        (("controller=hqp", "route=explicit", "solver=proxqp"), "hqp", "proxqp"),
    ],
)
def test_a_code_of_before_may_name_a_route(before: tuple[str, ...], controller: str, solver: str) -> None:
    """The route "explicit" of older codes is now the controller himpc_printed; for other controllers, both
    routes had the same torques."""
    state = decode(encode(State(RunSpec("planar3-hold", set=before))))
    found = state.run.prepared().settings
    assert isinstance(found, TorqueSettings)
    assert (found.controller, found.solver) == (controller, solver)
    TorqueSession(state.run.prepared()).tick()  # pyright: ignore[reportArgumentType]
