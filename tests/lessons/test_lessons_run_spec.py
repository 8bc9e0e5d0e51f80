"""RunSpec describes a run as data; command line, lessons, jobs, codes and page use the same type."""

from __future__ import annotations

import re
import shlex

import pytest

from app.link.choice import SceneChoice
from lessons.events import Push
from lessons.replay.script import script
from lessons.replay.state import decode, encode, state_of
from lessons.scenes.run_spec import MAX_SEED, RunSpec
from robots import InputError


def test_everything_is_in_place_and_the_run_can_be_a_key() -> None:
    events = ((0.1, Push("link_3", (0.1, 0.0, 0.0))),)
    spec = RunSpec("planar3-circle", controller="hqp", set=("horizon=7",), events=events, duration=0.5)
    spec = spec.but("plant.payload_kg=1")
    scene = spec.prepared()
    assert scene.settings.controller == "hqp" and scene.settings.horizon == 7
    assert scene.settings.plant.payload_kg == 1.0 and scene.duration == 0.5 and scene.events == spec.events
    assert {spec: 1}[spec.but()] == 1 and spec.but("Q=3") != spec
    own = RunSpec("planar3-circle").prepared()
    assert own.duration == 8.0 and own.settings.controller == "himpc"


def test_the_command_line_says_all_but_the_script() -> None:
    spec = RunSpec("hold", "my arm.urdf", "tool", "osf", ("Q=[1,2]",), duration=2.5, seed=4)
    assert shlex.split(spec.command_line()) == [
        "himpc-lab", "run", "hold", "--urdf", "my arm.urdf", "--tip", "tool", "--controller", "osf",
        "--duration", "2.5", "--seed", "4", "--set", "Q=[1,2]",
    ]  # fmt: skip
    assert RunSpec("planar3-hold", set=("controller=osf",)).command_line().endswith("--controller osf")


def test_held_joints_travel_with_a_run() -> None:
    """The command line, the state code, the script and the page carry which joints are held."""
    spec = RunSpec("hold", "planar3", hold=("joint_2=0.3", "joint_[3]"), seed=3)
    scene = spec.prepared()
    assert scene.robot.joint_names == ("joint_1",)
    assert shlex.split(spec.command_line())[3:] == [
        "--urdf", "planar3", "--hold", "joint_2=0.3", "--hold", "joint_[3]", "--seed", "3",
    ]  # fmt: skip
    code = encode(state_of(spec, scene.settings.changed("horizon", 7)))
    again = decode(code).run
    assert (again.urdf, again.hold, again.seed) == (spec.urdf, spec.hold, 3)
    assert again.prepared().settings == scene.settings.changed("horizon", 7)
    assert SceneChoice.of_run(spec).scene().robot.n == 1
    assert "load_scene('hold', 'planar3', hold=('joint_2=0.3', 'joint_[3]'))" in script(spec, (), 1.0)
    with pytest.raises(InputError, match="brings its own robot"):
        RunSpec("panda-hold", hold=("joint3",)).prepared()


@pytest.mark.parametrize("duration", [1234.5678, 0.1 + 0.2, 1e-7, 4.0, 3])
def test_the_command_line_has_every_digit_of_the_duration(duration: float) -> None:
    words = shlex.split(RunSpec("iiwa14-hold", duration=duration).command_line())
    assert float(words[-1]) == duration and not words[-1].endswith(".0")


def test_a_command_line_with_a_seed_repeats_the_run() -> None:
    for seed in (0, 7, MAX_SEED):
        (found,) = re.findall(r"--seed (\d+)", RunSpec("planar3-hold", seed=seed).command_line()) or ["0"]
        assert int(found) == seed
    for seed in (-1, MAX_SEED + 1):
        with pytest.raises(InputError, match=f"seed is {seed}: give a whole number from 0"):
            RunSpec("planar3-hold", seed=seed)


def test_what_cannot_be_run_is_one_sentence() -> None:
    for spec in (RunSpec("planar3-hlod"), RunSpec("planar3-hold", controller="htmpc")):
        with pytest.raises(InputError, match="planar3-hold"):
            spec.prepared()


def test_a_page_begins_with_the_controller_of_a_run() -> None:
    spec = RunSpec("planar3-hold", controller="osf", set=("horizon=3",), seed=2)
    choice = SceneChoice.of_run(spec)
    assert choice.scene().settings == spec.prepared().settings and choice.run.seed == 2
