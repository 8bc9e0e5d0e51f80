"""The page, lists and messages are made from the descriptions of the settings at their fields."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from docs.settings import FILE, text
from lessons.events import MoveTarget
from lessons.scenes.catalog import load_scene, torque_scene
from lessons.scenes.names import ALL_SCENES
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import parse_assignment
from lessons.settings.listing import lines, usual_settings
from lessons.settings.settings import SceneSettings
from lessons.settings.values import NUMBER, WHOLE
from robots import InputError
from robots.ranges import Shown


@cache
def settings_of(scene: str) -> SceneSettings:
    return load_scene(scene, "planar3" if scene == "hold" else None).settings


SCENES = sorted(ALL_SCENES)


@pytest.mark.parametrize("scene", SCENES)
def test_every_setting_is_described_and_its_ends_are_allowed(scene: str) -> None:
    settings = settings_of(scene)
    for path in settings.paths():
        if re.fullmatch(r"levels\.\d+\..*", path):
            continue  # the path with the place of a level is equivalent to the path with its name
        shown, form = settings.setting(path).shown, settings.setting(path).form
        assert shown != Shown(path.rpartition(".")[2], name=path), f"no description of {path}"
        if shown.low < shown.high and form.kind in (NUMBER, WHOLE):
            for end in (shown.low, shown.high):
                value = end / shown.factor
                settings.changed(path, int(value) if form.kind == WHOLE else value)


@pytest.mark.parametrize("scene", SCENES)
def test_no_setting_takes_numbers_that_no_computer_can_use(scene: str) -> None:
    """With K_p = 1e300 the controller failed: 1e300 overflows when it is multiplied."""
    settings = settings_of(scene)
    for path, setting in settings.table().items():
        form = setting.form
        if {form.kind, form.elements} & {NUMBER, WHOLE} and not path.endswith(".horizon"):
            for value in (1e15, -1e15):
                given = [value] * 2 if form.kind is None else value
                with pytest.raises(InputError, match=rf"{re.escape(path.split('.')[0])}"):
                    settings.changed(path, given)


@pytest.mark.parametrize("controller", ["himpc", "himpc_printed", "weighted", "hqp", "osf"])
def test_at_the_ends_of_the_ranges_torques_are_finite(controller: str) -> None:
    """The hand is dragged for 40 ms with each setting at the ends of its range."""
    scene = torque_scene("planar3-hold")
    settings = scene.settings.changed("controller", controller)
    for path in (
        "levels.1.K_p",
        "levels.1.K_v",
        "Q",
        "R",
        "M_bar_scale",
        *(f"limits.{kind}_scale" for kind in ("torque", "velocity")),
    ):
        for end in (settings.setting(path).form.range.low, settings.setting(path).form.range.high):
            session = TorqueSession(replace(scene, settings=settings.changed(path, end)))
            session.post(MoveTarget("position", (0.5, 0.4)))
            for _ in range(40):
                assert np.isfinite(session.tick()[session.layout.fields["tau"]]).all(), (path, end)


@pytest.mark.parametrize("scene", SCENES)
def test_the_order_of_lists_names_settings_only(scene: str) -> None:
    """A path that no scene of the kind has is a typing error, or belongs to a setting that was removed."""
    of = type(settings_of(scene))
    known = {path for each in SCENES if type(settings_of(each)) is of for path in settings_of(each).paths()}
    for head in of.page_order:
        assert not head or any(path == head or path.startswith(f"{head}.") for path in known), head


@pytest.mark.parametrize("scene", SCENES)
def test_what_is_worth_trying_is_allowed(scene: str) -> None:
    settings = settings_of(scene)
    usual = usual_settings(settings)
    assert len({each.shown.name for each in usual}) == len(usual) > 5
    for each in usual:
        for value in each.shown.tries:
            settings.changed(*parse_assignment(f"{each.path}={value}"))


@pytest.mark.parametrize(
    ("scene", "path", "value", "says"),
    [
        ("planar3-hold", "horizon", 80, "a whole number from 1 to 60"),
        ("planar3-hold", "T_s", 1.0, "a number from 0.0001 to 0.02"),
        ("planar3-hold", "M_bar_scale", 0, "a number from 1e-06 to 1e+06"),
        ("planar3-hold", "plant.delay_ms", -1.0, "a number from 0 to 1000"),
        ("planar3-hold", "plant.mass_scale", [1, 0, 1], "a number from 0.001 to 1000 or a list of such"),
        ("planar3-hold", "nominal.mass_scale", 0, "nominal.mass_scale is 0"),
        ("planar3-hold", "limits.position", "paper ", "did you mean 'paper'"),
        ("planar3-hold", "levels.position.Q", 0, "levels.position.Q is 0: give a number from 1e-12 to 1e+12"),
        ("planar3-hold", "tasks.position.K_p", -1, "a number from 0 to 1e+08"),
        ("planar3-hold", "M_bar.2", 0, "a number from 1e-12 to 1e+12"),
        ("ridgeback-ur10-square", "horizon", 80, "a whole number from 1 to 40"),
        ("ridgeback-ur10-square", "delta_m", 2.0, "a number from 0 to 1"),
        ("ridgeback-ur10-square", "peak", 3, "a list"),
        ("ridgeback-ur10-square", "gains.3", 1.0, "from 1 to 2"),
        ("ridgeback-ur10-delivery", "rounds", 0, "a whole number from 1 to 100"),
    ],
)
def test_a_refusal_says_what_is_allowed(scene: str, path: str, value: object, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        settings_of(scene).changed(path, value)


def test_one_gain_of_several() -> None:
    settings = settings_of("ridgeback-ur10-square").changed("gains.2", 0.7)
    assert settings.value_at("gains") == (0.5, 0.7) and settings.value_at("gains.2") == 0.7


def test_a_level_is_read_by_its_name_wherever_it_stands() -> None:
    """A control of the page keeps its path when the order of the levels changes."""
    settings = settings_of("planar3-hold")
    read = settings.setting("levels.position.Q").read
    names = settings.value_at("order")
    turned = settings.changed("levels.position.Q", 7.0).changed("order", list(reversed(names)))
    assert read(turned) == 7.0 == turned.value_at("levels.position.Q")


def test_the_reference_is_what_the_fields_say() -> None:
    assert FILE.read_text() == text(), "python -m docs.settings writes it anew"


def test_a_scene_lists_its_settings_with_what_is_allowed() -> None:
    found = {line.path: line for line in lines(settings_of("planar3-hold"))}
    assert found["horizon"].allowed == "a whole number from 1 to 60" and found["horizon"].now == "5"
    assert found["plant.payload_kg"].unit == "kg" and "levels.1.Q" not in found
    for path, line in found.items():
        settings_of("planar3-hold").changed(*parse_assignment(f"{path}={line.now}"))
