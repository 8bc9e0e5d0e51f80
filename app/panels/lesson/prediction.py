"""The prediction of a step: entered before the run and compared with the measured value after the run."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from app.adapter.names import BUTTON_INNER, BUTTON_LABEL
from app.adapter.private import dom_id
from app.html.markdown import rendered_line
from app.html.palette import BAD, BOUND, GOOD, LEVELS, button, css
from app.html.text import badge, block, figure, readable
from app.link.exercise import Answer, Lecture, Predict
from app.panels.lesson.drawing import scale, sketch
from app.panels.widgets.command import on_change, on_click
from app.panels.widgets.controls import STEPS, only_track, place_of, value_at
from lessons.teaching.prediction import Choice, Prediction, Sketch, Value

_LETTERS = "ABCDEFG"
_POINTS = 5


class Asking:
    """The input of a prediction. A prediction is sent at once and may be changed until the run begins."""

    def __init__(self, gui: viser.GuiApi, prediction: Prediction, send: Callable[[Predict], None]) -> None:
        self._prediction, self._send = prediction, send
        self._mine: Answer | None = None
        self._picture = gui.add_html("")
        self._inputs: list[Any] = []
        self._options: list[viser.GuiButtonHandle] = []
        self._style = gui.add_html("")
        match prediction:
            case Choice():
                self._offer(gui, prediction)
            case Value():
                self._weigh(gui, prediction)
            case Sketch():
                self._draw(gui, prediction)
        self._verdict = gui.add_html("", visible=False)
        self._write(None)

    # ---------------------------------------------------------------- asking

    def _offer(self, gui: viser.GuiApi, choice: Choice) -> None:
        for k in range(len(choice.options)):
            option = gui.add_button(_label(choice, k, None, math.nan))
            on_click(option, partial(self._say, k))
            self._options.append(option)

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
        self._style.content = only_track(slider)
        self._inputs.append(slider)
        on_change(slider, lambda: self._say(value_at(float(slider.value), value.low, value.high)))

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

        def say() -> None:
            self._say(tuple((wanted.until * k / _POINTS, float(s.value)) for k, s in enumerate(sliders)))

        for slider in sliders:
            on_change(slider, say)

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
        self._send(Predict(answer))
        self._write(None)

    # ---------------------------------------------------------------- showing

    def show(self, lecture: Lecture) -> None:
        """Updates the input during the run, and shows the measured value after the run."""
        if self._mine is None and lecture.answer is not None:
            self._recall(lecture.answer)
        before = lecture.phase in ("waiting", "preparing") and lecture.grade is None
        for each in self._inputs:
            each.visible = before
        for k, each in enumerate(self._options):
            each.disabled = not before
            each.visible = lecture.grade is None or k in self._compared(lecture)
        self._write(lecture)

    def _compared(self, lecture: Lecture) -> tuple[object, ...]:
        """Returns the options that stay after the run: the learner's and the right one, or all if none is
        right."""
        assert isinstance(self._prediction, Choice)
        right = self._prediction.right(lecture.truth)
        return (lecture.answer, right) if right is not None else tuple(range(len(self._options)))

    def _recall(self, answer: Answer) -> None:
        """Restores the prediction after a page was reloaded."""
        self._mine = answer
        if isinstance(self._prediction, Value) and isinstance(answer, (int, float)):
            slider = self._inputs[0]
            assert isinstance(slider, viser.GuiSliderHandle)
            slider.value = place_of(answer, self._prediction.low, self._prediction.high)

    def _write(self, lecture: Lecture | None) -> None:
        known = lecture if lecture is not None and lecture.grade is not None else None
        html = f"<b>{'Predict' if known is None else 'You predicted'}:</b> "
        html += rendered_line(self._prediction.question) + self._pictured(known)
        self._picture.content = _ruled(html)
        choice = self._prediction if isinstance(self._prediction, Choice) else None
        told = choice is not None and known is not None and choice.right(known.truth) is not None
        self._verdict.visible = known is not None and not told  # the buttons tell it
        if known is not None and known.grade is not None and not told:
            score = known.grade.score
            word, colour = (
                ("RIGHT", GOOD) if score >= 0.999 else ("NEARLY", LEVELS[1]) if score > 0 else ("NOT SO", BAD)
            )
            words = f"{badge(word, colour)} {rendered_line(readable(known.grade.words))}"
            self._verdict.content = _ruled(words)

    def _pictured(self, lecture: Lecture | None) -> str:
        """Returns the picture of the prediction. The options of a choice, which are buttons, are updated
        instead.

        lecture: the graded run, which contains no answer that came too late; None before the run is graded.
        """
        truth, mine = (math.nan, self._mine) if lecture is None else (lecture.truth, lecture.answer)
        match self._prediction:
            case Choice() as choice:
                self._mark(choice, mine, truth)
                return ""
            case Value() as value:
                guess = mine if isinstance(mine, (int, float)) else self.suggested
                assert isinstance(guess, (int, float))
                return scale(value.low, value.high, guess, truth, value.factor, value.measure.unit)
            case Sketch() as wanted:
                points = mine if isinstance(mine, tuple) else self.suggested
                assert isinstance(points, tuple)
                curve = None if lecture is None else lecture.sketched
                return sketch(wanted.low, wanted.high, wanted.until, points, curve, wanted.signal.unit)

    def _mark(self, choice: Choice, mine: Answer | None, truth: float) -> None:
        """Marks the chosen option, and the right one after the run, with words and colours."""
        right = choice.right(truth)
        rules = _OPTIONS.format(", ".join(f'[id="{dom_id(each)}"]' for each in self._options))
        for k, option in enumerate(self._options):
            option.label = _label(choice, k, mine, truth)
            if k in (mine, right):
                filled = css(button(GOOD if k == right else BAD)) if right is not None else css(_CHOSEN, 0.18)
                rules += _COLOURED.format(
                    dom_id(option), filled, "#fff" if right is not None else "inherit", css(_CHOSEN)
                )
        self._style.content = f"<style>{rules}</style>"


def _label(choice: Choice, place: int, mine: Answer | None, truth: float) -> str:
    right = choice.right(truth)
    marks = [] if right is None or place not in (mine, right) else ["✓" if place == right else "✗"]
    marks += ["your answer"] if place == mine else []
    marks += [f"measured: {figure(truth, choice.measure.unit)}"] if place == right else []
    return f"{_LETTERS[place]}   {choice.options[place].text}" + (f"   ({' '.join(marks)})" if marks else "")


_CHOSEN = LEVELS[1]
# Mantine centres the label, cuts it off, and makes a disabled button pale.
_OPTIONS = (
    ":is({0}){{height:auto!important;min-height:2.4em;padding:0.35em 0.8em;opacity:1;text-align:left;"
    f"background:transparent;color:inherit;border:1px solid {css(BOUND)}}}}}"
    ":is({0}):not(:disabled):hover{{" + f"background:{css(_CHOSEN, 0.12)}}}}}"
    f":is({{0}}) {BUTTON_INNER}{{{{justify-content:flex-start}}}}"
    f":is({{0}}) {BUTTON_LABEL}{{{{white-space:normal;height:auto;font-weight:500}}}}"
)
_COLOURED = '[id="{0}"],[id="{0}"]:hover{{background:{1}!important;color:{2}!important;border-color:{3}}}'


def _ruled(html: str) -> str:
    return block(html, f"border-left:3px solid {css(LEVELS[0])};margin:0.3em 0")
