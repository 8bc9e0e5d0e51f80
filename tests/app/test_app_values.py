"""Invalid values for a page's controls are refused with a notice, and the page keeps working."""

from __future__ import annotations

import math
import random as chance
import time
from typing import Any

import msgspec
import pytest
from served import served
from viser import _messages

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec

VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 3.7, math.nan, math.inf, -math.inf, 1e308, -1e308, 2**63 - 1, "", "word",
    "nan", "12", "x" * 300_000, [], [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], [math.nan] * 3, ["a"], [[1]],
    {}, {"a": 1}, b"bytes",
)  # fmt: skip
NAMES = (
    "label", "visible", "disabled", "order", "hint", "options", "min", "max", "step", "precision", "content",
    "uuid", "gui_api", "props", "removed", "update_cb", "sync_cb", "is_button", "parent_container_id",
    "update_timestamp", "hold_cbs_from_freq", "_impl", "__class__", "no_such_thing",
)  # fmt: skip

INLET = pytest.mark.nightly("app/adapter", "app/panels", "app/web")


@pytest.mark.parametrize(
    "choice",
    [
        pytest.param(SceneChoice(RunSpec("planar3-hold")), id="torque"),
        pytest.param(SceneChoice(RunSpec("ridgeback-ur10-drag")), id="velocity", marks=INLET),
        pytest.param(SceneChoice.of_lesson(LessonPlace("deadlines")), id="lesson", marks=INLET),
    ],
)
def test_whatever_is_written_the_page_goes_on(choice: SceneChoice, capfd: pytest.CaptureFixture[str]) -> None:
    random = chance.Random(11)
    with served(choice) as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("every command, searchable") and page.shows("t = "))
        learner = server.sessions.learners[0]
        inputs = {uuid: each for uuid, each in list(page.controls.items()) if "value" in each}
        assert len(inputs) > 20
        pressable = ("GuiButtonMessage", "GuiButtonGroupMessage", "GuiUploadButtonMessage")
        tried: set[str] = set()
        for uuid, control in inputs.items():
            for name in NAMES if control["type"] not in tried else random.sample(NAMES, 3):
                page.write(uuid, **{name: random.choice(VALUES)})
                page.write(uuid, **{"value": control["value"], name: random.choice(VALUES)})
            if control["type"] not in pressable:  # a press is not a bad value
                for value in VALUES if control["type"] not in tried else random.sample(VALUES, 4):
                    page.write(uuid, value=value)
            tried.add(control["type"])
            time.sleep(0.05)  # slowly, because floods are tested elsewhere
        page.say(_messages.GuiUpdateMessage("no such control", {"value": 1}))
        page.say(_messages.GuiUpdateMessage(next(iter(inputs)), {}))
        odd = {"type": "GuiUpdateMessage", "uuid": 5, "updates": 7}
        page.send(msgspec.msgpack.encode(odd))
        assert eventually(lambda: any(title == "Not changed" for title, _ in page.notices))
        label = choice.exercise is None
        assert_is_alive(page, learner, label)
    assert "Traceback" not in capfd.readouterr().err


def assert_is_alive(page: Wire, learner: Any, runs: bool) -> None:
    """Checks that the session responds, the page shows its state, and presses take effect."""
    assert learner.failure is None
    before = learner.status.ticks
    page.use("Playback", "Step")
    assert eventually(lambda: page.shows("Paused"))
    if runs:
        assert eventually(lambda: learner.status.ticks != before)
    page.use("Speed", 0.5)
    assert eventually(lambda: learner.status.speed == 0.5)


def test_a_press_whose_panel_goes_meanwhile_is_told_of(capfd: pytest.CaptureFixture[str]) -> None:
    """The callback writes to a control that was removed meanwhile: the user gets a notice, and no traceback
    is printed."""
    with served() as server, Wire(server.link) as page:
        assert eventually(lambda: page.shows("every command, searchable"))
        (client,) = server._viser.get_clients().values()
        folder = client.gui.add_folder("Goes")
        with folder:
            button, words = client.gui.add_button("Rebuild me"), client.gui.add_html("")

        @button.on_click
        async def _(_: object) -> None:
            folder.remove()
            words.content = "too late"

        page.use("Rebuild me")
        assert eventually(lambda: "Not taken" in [title for title, _ in page.notices])
    assert "Traceback" not in capfd.readouterr().err


def test_one_click_on_a_number_changes_its_second_digit() -> None:
    """The step of a number input is a tenth of the number's decade, at most 0.1."""
    with (
        served(SceneChoice(RunSpec("planar3-hold", set=("M_bar=[0.04,0.5,30]",)))) as server,
        Wire(server.link) as page,
    ):

        def steps() -> list[float]:
            numbers = [each for each in list(page.controls.values()) if each["type"] == "GuiNumberMessage"]
            return [each["props"]["step"] for each in numbers if each["value"] in (0.04, 0.5, 30.0)]

        assert eventually(lambda: len(steps()) == 3)
        assert steps() == pytest.approx([0.001, 0.01, 0.1])
