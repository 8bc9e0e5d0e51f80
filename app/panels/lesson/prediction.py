"""The prediction of a step: entered before the run and compared with the measured value after the run."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import viser

from app.html.markdown import rendered_line
from app.html.palette import BAD, GOOD, LEVELS, css
from app.html.text import badge, block, figure, readable
from app.link.exercise import Answer, Lecture
from app.panels.lesson.drawing import scale, sketch
from app.panels.widgets.command import on_click
from app.panels.widgets.controls import STEPS, only_track, place_of, value_at
from lessons.teaching.prediction import Choice, Prediction, Sketch, Value

_LETTERS = "ABCDEFG"
_POINTS = 5


class Asking:
    """The input of a prediction. A prediction is sent at once and may be changed until the run begins."""

    def __init__(self, gui: viser.GuiApi, prediction: Prediction, predict: Callable[[Answer], None]) -> None:
        self._prediction, self._predict = prediction, predict
        self._mine: Answer | None = None
        self._shown = ""
        self._picture = gui.add_html("")
        self._inputs: list[Any] = []
        self._style: viser.GuiHtmlHandle | None = None
        match prediction:
            case Choice():
                self._offer(gui, prediction)
            case Value():
                self._weigh(gui, prediction)
            case Sketch():
                self._draw(gui, prediction)
        self._write(None)

    # ---------------------------------------------------------------- asking

    def _offer(self, gui: viser.GuiApi, choice: Choice) -> None:
        letters = tuple(_LETTERS[: len(choice.options)])
        buttons = gui.add_button_group("I expect", letters)
        self._inputs.append(buttons)

        on_click(buttons, lambda: self._say(letters.index(str(buttons.value))))

    def _weigh(self, gui: viser.GuiApi, value: Value) -> None:
        slider = gui.add_slider(
            "My guess",
            min=0,
            max=STEPS,
            step=1,
            initial_value=STEPS // 2,
            marks=((0, figure(value.low)), (STEPS, figure(value.high))),
            hint="A logarithmic slider; the arrow keys also move it",
        )
        self._style = gui.add_html(only_track(slider))
        self._inputs.append(slider)

        @slider.on_update
        async def _(_: object) -> None:
            self._say(value_at(float(slider.value), value.low, value.high))

    def _draw(self, gui: viser.GuiApi, wanted: Sketch) -> None:
        sliders = []
        for k in range(_POINTS + 1):
            t = wanted.until * k / _POINTS
            sliders.append(
                gui.add_slider(
                    f"at {t:.2g} s",
                    min=wanted.low,
                    max=wanted.high,
                    step=(wanted.high - wanted.low) / 60,
                    initial_value=wanted.low,
                    hint="The value of the curve at this moment",
                )
            )
        self._inputs += sliders
        for slider in sliders:

            @slider.on_update
            async def _(_: object) -> None:
                self._say(tuple((wanted.until * k / _POINTS, float(s.value)) for k, s in enumerate(sliders)))

    @property
    def suggested(self) -> Answer | None:
        """The prediction that counts if the learner enters no prediction: a slider counts with its initial
        value."""
        match self._prediction:
            case Choice():
                return None
            case Value() as value:
                return value_at(STEPS / 2, value.low, value.high)
            case Sketch() as wanted:
                return tuple((wanted.until * k / _POINTS, wanted.low) for k in range(_POINTS + 1))

    def _say(self, answer: Answer) -> None:
        self._mine = answer
        self._predict(answer)
        self._write(None)

    # ---------------------------------------------------------------- showing

    def show(self, lecture: Lecture) -> None:
        """Updates the input during the run, and shows the measured value after the run."""
        if self._mine is None and lecture.answer is not None:
            self._recall(lecture.answer)
        before = lecture.phase in ("waiting", "preparing") and lecture.grade is None
        for each in self._inputs:
            if each.visible != before:
                each.visible = before
        self._write(lecture)

    def _recall(self, answer: Answer) -> None:
        """Restores the prediction after a page was reloaded."""
        self._mine = answer
        if isinstance(self._prediction, Value) and isinstance(answer, (int, float)):
            slider = self._inputs[0]
            assert isinstance(slider, viser.GuiSliderHandle)
            slider.value = place_of(answer, self._prediction.low, self._prediction.high)

    def _write(self, lecture: Lecture | None) -> None:
        known = lecture is not None and lecture.grade is not None
        html = f"<b>{'You predicted' if known else 'Predict'}:</b> {rendered_line(self._prediction.question)}"
        if lecture is not None and lecture.grade is not None:
            grade = lecture.grade
            word, colour = (
                ("RIGHT", GOOD)
                if grade.score >= 0.999
                else ("NEARLY", LEVELS[1])
                if grade.score > 0
                else ("NOT SO", BAD)
            )
            html += (
                self._pictured(lecture)
                + f"<div>{badge(word, colour)} {rendered_line(readable(grade.words))}</div>"
            )
        else:
            html += self._pictured(None)
        html = block(html, f"border-left:3px solid {css(LEVELS[0])};margin:0.3em 0")
        if html != self._shown:
            self._shown = html
            self._picture.content = html

    def _pictured(self, lecture: Lecture | None) -> str:
        """Returns the picture of the prediction.

        lecture: the graded run, which contains no answer that came too late; None before the run is graded.
        """
        truth, mine = (math.nan, self._mine) if lecture is None else (lecture.truth, lecture.answer)
        match self._prediction:
            case Choice() as choice:
                return _options(choice, mine, truth)
            case Value() as value:
                guess = mine if isinstance(mine, (int, float)) else self.suggested
                assert isinstance(guess, (int, float))
                return scale(value.low, value.high, guess, truth, value.factor, value.measure.unit)
            case Sketch() as wanted:
                points = mine if isinstance(mine, tuple) else self.suggested
                assert isinstance(points, tuple)
                curve = None if lecture is None else lecture.sketched
                return sketch(wanted.low, wanted.high, wanted.until, points, curve, wanted.signal.unit)


def _options(choice: Choice, picked: Answer | None, truth: float) -> str:
    right = choice.right(truth)
    rows = ""
    for k, option in enumerate(choice.options):
        mine = k == picked
        note = ""
        if right is not None:
            note = " <b>✓ measured</b>" if k == right else " <b>✗ not measured</b>" if mine else ""
        colour = css(GOOD, 0.2) if k == right else css(LEVELS[0], 0.18) if mine else "transparent"
        rows += (
            f'<div style="background:{colour};border-radius:4px;padding:0.1em 0.4em">'
            f"{'●' if mine else '○'} <b>{_LETTERS[k]}</b> {rendered_line(option.text)}"
            f"{' <i>(your answer)</i>' if mine else ''}{note}</div>"
        )
    return rows
