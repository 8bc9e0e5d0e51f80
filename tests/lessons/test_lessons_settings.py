"""Settings have paths, and a learner can change each of them; a wrong type or path is answered by one clear
sentence."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lessons.scenes.catalog import load_scene, torque_scene
from lessons.settings.assignments import parse_assignment, with_assignments
from lessons.settings.torque import TorqueSettings
from robots import InputError

START = torque_scene("iiwa14-circle").settings


@pytest.fixture
def start() -> TorqueSettings:
    return START


def test_a_path_reaches_its_field_and_nothing_else(start: TorqueSettings) -> None:
    """Each assignment changes its own field, and all others keep their values."""
    expected: dict[str, tuple[Any, Any]] = {
        "horizon": (10, lambda s: s.horizon),
        "T_s": (0.002, lambda s: s.T_s),
        "M_bar_scale": (2.0, lambda s: s.M_bar_scale),
        "M_bar": ([0.1] * 7, lambda s: list(s.M_bar)),
        "solver": ("proxqp", lambda s: s.solver),
        "controller": ("himpc_printed", lambda s: s.controller),
        "R_on": ("acceleration", lambda s: s.R_on),
        "damping": (False, lambda s: s.damping),
        "limits.position": ("paper", lambda s: s.limits.position),
        "limits.velocity_scale": (2.0, lambda s: s.limits.velocity_scale),
        "limits.torque": (False, lambda s: s.limits.torque),
        "plant.payload_kg": (2.0, lambda s: s.plant.payload_kg),
        "plant.inertia_scale": (0.8, lambda s: s.plant.inertia_scale),
        "plant.encoder_resolution_deg": (0.005, lambda s: s.plant.encoder_resolution_deg),
        "plant.saturate": (False, lambda s: s.plant.saturate),
        "plant.delay_ms": (3.0, lambda s: s.plant.delay_ms),
        "levels.2.Q": (50.0, lambda s: s.levels[1].Q),
        "levels.2.R": (3.0, lambda s: s.levels[1].R),
        "levels.2.horizon": (2, lambda s: s.levels[1].horizon),
        "levels.2.enabled": (False, lambda s: s.levels[1].enabled),
        "levels.1.K_p": (300.0, lambda s: s.levels[0].tasks[0].K_p),
        "levels.q1.K_v": (7.0, lambda s: s.levels[2].tasks[0].K_v),
        "tasks.orientation.K_p": (80.0, lambda s: s.levels[1].tasks[0].K_p),
    }
    for path, (value, read) in expected.items():
        new = start.changed(path, value)
        assert read(new) == value != read(start)
        touched = [f.name for f in fields(TorqueSettings) if getattr(new, f.name) != getattr(start, f.name)]
        head = path.split(".")[0]
        assert touched == ["stack" if head in ("levels", "tasks") else head]


@pytest.mark.parametrize("scene", ["iiwa14-circle", "ridgeback-ur10-delivery"])
def test_one_table_of_paths_serves_all_values(scene: str) -> None:
    """Settings with changed values share one table of paths; settings with other levels have another
    table."""
    settings = load_scene(scene).settings
    changed = with_assignments(settings, ["horizon=7", "levels.1.Q=3"])
    assert changed.table() is settings.table()
    assert torque_scene("planar3-hold").settings.table() is not settings.table()


def test_one_joint_of_many(start: TorqueSettings) -> None:
    """A path with a joint number changes only this joint; before this, a single number is extended to all
    joints."""
    scaled = start.changed("plant.inertia_scale.2", 0.5)
    assert scaled.plant.inertia_scale == (1.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0)
    again = scaled.changed("plant.inertia_scale.7", 2.0).plant.inertia_scale
    assert again == (1.0, 0.5, 1.0, 1.0, 1.0, 1.0, 2.0)
    assert start.changed("M_bar.1", 0.25).M_bar == (0.25, *start.M_bar[1:])
    for path, value, says in (
        ("M_bar.8", 1.0, "from 1 to 7"),
        ("M_bar.0", 1.0, "from 1 to 7"),
        ("M_bar.1", "much", "give a number"),
        ("plant.payload_kg.1", 1.0, "plant.payload_kg"),
    ):
        with pytest.raises(InputError, match=says):
            start.changed(path, value)


def test_every_listed_path_is_taken(start: TorqueSettings) -> None:
    """`paths` lists exactly the paths that `changed` accepts, and each accepts its present value."""
    assert len(start.paths()) == len(set(start.paths())) > 40
    for path in start.paths():
        head, _, rest = path.partition(".")
        if head in ("levels", "tasks", "Q", "R"):
            value: Any = {"enabled": True, "horizon": 3}.get(rest.rpartition(".")[2], 7.0)
        else:
            value = start.value_at(path)
        assert isinstance(start.changed(path, value), TorqueSettings)


def test_weights_of_all_levels_at_once(start: TorqueSettings) -> None:
    """Q and R accept one number for all levels, or one per level; the weight of a level may have one entry
    per coordinate."""
    assert [level.Q for level in start.changed("Q", 5).levels] == [5.0, 5.0, 5.0]
    assert [level.R for level in start.changed("R", [1, 2, 3]).levels] == [1.0, 2.0, 3.0]
    assert start.changed("levels.1.Q", [1, 2, 3]).levels[0].Q == (1.0, 2.0, 3.0)
    with pytest.raises(InputError, match="one per level"):
        start.changed("Q", [1, 2])


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("horizn", "horizon"),
        ("Horizon", "horizon"),
        ("levels.2.q", "levels.2.Q"),
        ("levels.4.Q", "levels.1.Q"),
        ("levels.postion.Q", "levels.position.Q"),
        ("limits.velocity_scal", "limits.velocity_scale"),
        ("plant.payload", "plant.payload_kg"),
        ("mbar_scale", "M_bar_scale"),
    ],
)
def test_a_typo_names_the_nearest_path(start: TorqueSettings, wrong: str, right: str) -> None:
    """The error is one sentence with the name that was probably meant."""
    with pytest.raises(InputError) as error:
        start.changed(wrong, 1)
    suggestion = str(error.value).split("did you mean '")[1].split("'")[0]
    assert suggestion == right or suggestion.split(".")[0::2] == right.split(".")[0::2]
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("horizon", 0),
        ("horizon", 2.5),
        ("horizon", "many"),
        ("horizon", True),
        ("horizon", 1000),
        ("T_s", 0.0),
        ("T_s", 1.0),
        ("M_bar_scale", 0.0),
        ("M_bar_scale", float("nan")),
        ("M_bar", 0.1),
        ("M_bar", [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, -0.1]),
        ("M_bar", ["a"] * 7),
        ("solver", "magic"),
        ("solver", 3),
        ("route", "direct"),
        ("R_on", "wheels"),
        ("controller", "pid"),
        ("damping", 1),
        ("Q", 0),
        ("R", -1),
        ("levels.1.Q", float("inf")),
        ("levels.1.K_p", -1),
        ("levels.1.enabled", "yes"),
        ("levels.1.horizon", 0),
        ("limits.position", "sometimes"),
        ("limits.velocity", 2),
        ("limits.torque_scale", 0),
        ("plant.payload_kg", -1),
        ("plant.saturate", 1),
        ("plant.friction", "high"),
    ],
)
def test_a_value_that_cannot_be_is_refused(start: TorqueSettings, path: str, value: Any) -> None:
    """A wrong type or range is answered by one sentence, never by another exception."""
    with pytest.raises(InputError) as error:
        start.changed(path, value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) > 15


@given(
    path=st.sampled_from(START.paths()) | st.text(max_size=20),
    value=st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.lists(st.floats())
    ),
)
def test_any_value_is_taken_or_refused_in_words(path: str, value: Any) -> None:
    """Any value written into a field yields settings that a controller can use, or an InputError."""
    try:
        new = START.changed(path, value)
    except InputError as error:
        assert str(error)
    else:
        assert isinstance(new, TorqueSettings)


def test_assignments_are_json_or_words() -> None:
    assert parse_assignment("horizon=10") == ("horizon", 10)
    assert parse_assignment("plant.saturate=false") == ("plant.saturate", False)
    assert parse_assignment("R=[1, 2.5]") == ("R", [1, 2.5])
    assert parse_assignment("limits.position=paper") == ("limits.position", "paper")


@pytest.mark.parametrize(
    "text", ["horizon", "=3", "Q=NaN", "Q=nan", "Q=Infinity", "Q=-inf", "Q=", "R=[1, NaN]"]
)
def test_assignments_that_are_none(text: str) -> None:
    """An assignment without "=", or with a value that is not a number, is refused in a sentence that repeats
    it."""
    with pytest.raises(InputError, match="--set"):
        parse_assignment(text)


def test_later_assignments_build_on_earlier_ones(start: TorqueSettings) -> None:
    new = with_assignments(start, ["Q=5", "levels.2.Q=7", "limits.velocity_scale=2", "limits.position=off"])
    assert [level.Q for level in new.levels] == [5.0, 7.0, 5.0]
    assert (new.limits.velocity_scale, new.limits.position) == (2.0, "off")
    np.testing.assert_array_equal(new.for_controller().M_bar, start.M_bar)


def test_the_order_is_a_setting_of_its_own(start: TorqueSettings) -> None:
    """The order names every level, in one word or a list; for any other value, the error names the valid
    form."""
    names = [level.name for level in start.levels]
    turned = start.changed("order", ",".join(reversed(names)))
    assert [level.name for level in turned.levels] == names[::-1]
    assert turned.changed("order", names) == start
    for wrong in ("", names[0], [*names, names[0]], names[:2], 3, None):
        with pytest.raises(InputError, match="every level once"):
            start.changed("order", wrong)
