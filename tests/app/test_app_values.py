"""Invalid values for the controls of a page: each kind of control refuses each of them in a sentence. What a
page does then is tested with `benchmarks.hostile` (test_app_words.py)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
import viser

from app.panels.widgets.controls import _tenth
from app.web.inlet import NotAllowed, allowed

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 3.7, math.nan, math.inf, -math.inf, 1e308, -1e308, 2**63 - 1, 10**400, "",
    "word", "nan", "12", "x" * 300_000, [], [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], [math.nan] * 3, ["a"],
    [[1]], {}, {"a": 1}, b"bytes",
)  # fmt: skip
NAMES = (
    "label", "visible", "disabled", "order", "hint", "options", "min", "max", "step", "precision", "content",
    "uuid", "gui_api", "props", "removed", "update_cb", "sync_cb", "is_button", "parent_container_id",
    "update_timestamp", "hold_cbs_from_freq", "_impl", "__class__", "no_such_thing",
)  # fmt: skip


def test_every_control_takes_values_of_its_kind_only(viser_server: viser.ViserServer) -> None:
    """A value that is taken has the type of the present one, is finite, and lies within the control's
    range."""
    gui: Any = viser_server.gui
    slider, number = gui.add_slider("N", 1, 30, 1, 5), gui.add_number("Q", 2.0, min=0.0, max=1e6)
    menu, group = gui.add_dropdown("Solver", ("a", "b")), gui.add_button_group("Playback", ("Run", "Step"))
    upload = gui.add_upload_button("Upload a URDF")
    free = gui.add_number("Speed", 1.0)
    controls: tuple[tuple[Any, Callable[[Any], bool]], ...] = (
        (slider, lambda value: 1 <= value <= 30),
        (number, lambda value: 0.0 <= value <= 1e6),
        (free, math.isfinite),
        (gui.add_checkbox("Damping", True), lambda value: isinstance(value, bool)),
        (gui.add_text("Its name", "x"), lambda value: isinstance(value, str) and len(value) < 300_000),
        (gui.add_vector3("Gains", (1.0, 1.0, 1.0)), lambda value: all(map(math.isfinite, value))),
        (gui.add_button("Add"), lambda value: isinstance(value, bool)),
        (menu, lambda value: value in ("a", "b")),
        (group, lambda value: value in ("Run", "Step")),
        (upload, lambda _: False),
    )
    for control, right in controls:
        taken = 0
        for value in VALUES:
            try:
                found = allowed(control, {"value": value})
            except NotAllowed as refusal:
                assert str(refusal).endswith(".") and len(str(refusal)) < 500
            else:
                taken += 1
                assert right(found) and (isinstance(found, bool) is isinstance(control.value, bool)), value
        assert taken < len(VALUES) / 2
        for name in NAMES:
            for updates in ({name: 1}, {"value": control.value, name: 1}):
                with pytest.raises(NotAllowed, match="can only change the value"):
                    allowed(control, updates)
        for updates in ({}, 7, None, ["value"]):
            with pytest.raises(NotAllowed):
                allowed(control, updates)


def test_one_click_on_a_number_changes_its_second_digit() -> None:
    assert [_tenth(value) for value in (0.04, 0.5, 30.0)] == pytest.approx([0.001, 0.01, 0.1])
