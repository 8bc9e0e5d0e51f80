"""The comparison of two robots: the settings of the ghost, and the figures of both runs."""

from __future__ import annotations

import math
from collections.abc import Callable

import viser

from app.client.recording import RunFigures
from app.html.palette import BAD, BOUND, GHOST, button, ink
from app.html.text import badge, block, esc, quantity, swatch
from app.link.messages import Post
from app.tab.context import PageContext, SessionSnapshot
from lessons.session.ghost import swapped
from lessons.settings.listing import usual_settings
from lessons.settings.settings import SceneSettings
from lessons.teaching.lesson import Ghost
from robots import InputError

_SAME = "as the robot"
_NOTHING = "–"
_ROWS = 3


class ComparePanel:
    """The panel of the ghost. Callbacks only start and end ghosts; the state is read from the
    learner's simulation, so that a ghost that a lesson started is also shown."""

    def __init__(self, page: PageContext) -> None:
        gui, learner, settings = page.gui, page.learner, page.settings
        self._page, self._learner, self._colours = page, learner, page.colours
        self._choices = {each.shown.name: each for each in usual_settings(settings)}
        gui.add_html(_INTRO)
        self._controller = gui.add_dropdown(
            "Ghost's controller", (_SAME, *settings.controllers), initial_value=_SAME
        )
        self._folders: list[viser.GuiFolderHandle] = []
        self._settings = [self._row(gui, place) for place in range(1, _ROWS + 1)]
        self._start = gui.add_button("Start the ghost", color=button(GHOST))
        self._swap = gui.add_button(
            "Swap robot and ghost", hint="Robot and ghost swap settings and start again", visible=False
        )
        self._end = gui.add_button("Remove the ghost", visible=False)
        self._table = gui.add_html("", visible=False)

        # The callbacks run on a thread, as they start processes or wait for one to end.
        self._start.on_click(lambda _: self._begin())
        self._swap.on_click(lambda _: self._change_sides())
        self._end.on_click(lambda _: learner.stop_ghost())

    def _row(self, gui: viser.GuiApi, place: int) -> tuple[viser.GuiDropdownHandle[str], viser.GuiTextHandle]:
        with gui.add_folder(None, visible=place == 1) as folder:
            path = gui.add_dropdown(f"Difference {place}", (_NOTHING, *self._choices), initial_value=_NOTHING)
            value = gui.add_text("its value", "", visible=False)

        @path.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            choice = self._choices.get(str(path.value))
            value.visible = choice is not None
            if choice is not None and event.client is not None:
                value.value = choice.shown.tries[0]
                value.hint = f"for example {', '.join(choice.shown.tries)}"
            if choice is not None and place < _ROWS:
                self._folders[place].visible = True

        self._folders.append(folder)
        return path, value

    def _begin(self) -> None:
        own: list[str] = []
        words: list[str] = []
        if self._controller.value != _SAME:
            own.append(f"controller={self._controller.value}")
            words.append(str(self._controller.value))
        for path, value in self._settings:
            choice = self._choices.get(str(path.value))
            if choice is not None:
                own.append(f"{choice.path}={value.value}")
                words.append(f"{choice.shown.name} = {value.value}")
        if not own:
            self._page.notify("No difference", "Choose another controller or a setting for the ghost.")
            return
        self._learner.start_ghost(Ghost(", ".join(words), tuple(own)))

    def _change_sides(self) -> None:
        learner = self._learner
        ghost, settings = learner.ghost, learner.settings
        if ghost is None or settings is None:
            return
        try:
            own, events = swapped(settings, ghost.own)
        except InputError as error:
            self._page.notify("Not swapped", str(error))
            return
        for event in events:
            learner.send(Post(event))
        learner.start_ghost(Ghost(", ".join(own), own))

    def update(self, now: SessionSnapshot[SceneSettings]) -> None:
        """Shows the state of the ghost, and the results of both runs."""
        ghost = self._learner.ghost
        on = ghost is not None
        self._end.visible = self._swap.visible = self._table.visible = on
        self._start.label = "Start again with these" if on else "Start the ghost"
        if ghost is None:
            return
        mine, its = self._learner.figures, ghost.figures
        if its is None or mine is None or ghost.status is None:
            self._table.content = block(f"{badge('GHOST', GHOST)} is starting …")
            return
        self._table.content = _legend(ghost.words, now) + self._results(now, mine, its)

    def _results(self, now: SessionSnapshot[SceneSettings], mine: RunFigures, its: RunFigures) -> str:
        places = {level.name: place for place, level in enumerate(now.settings.levels, start=1)}
        tasks = sorted(now.ready.layout.tasks, key=lambda task: places.get(task.level, 99))
        rows = [
            _line(
                f"{swatch(self._colours.get(task.level, BOUND))}{places.get(task.level, '')} "
                f"{esc(task.name)}, RMSE",
                mine.rmse.get(task.name, math.nan),
                its.rmse.get(task.name, math.nan),
                lambda value, unit=task.unit: quantity(value, unit),
            )
            for task in tasks
        ]
        if math.isfinite(mine.torque_share):
            rows.append(
                _line("largest requested torque / bound", mine.torque_share, its.torque_share, _percent)
            )
        rows += [
            _line("unsolved QPs", mine.unsolved, its.unsolved, str),
            _line("control step, median", mine.step_ms, its.step_ms, _milliseconds),
            _line("control step, 99 % below", mine.slow_ms, its.slow_ms, _milliseconds),
        ]
        head = (
            '<tr><td></td><td style="text-align:right"><b>robot</b></td>'
            f'<td style="text-align:right;color:{ink(GHOST)}"><b>ghost</b></td></tr>'
        )
        return block(
            f'<table style="width:100%;border-spacing:0 0.25em">{head}{"".join(rows)}</table>'
            f"over {mine.seconds:.1f} s from their common start; the better value is bold"
        )


def _legend(words: str, now: SessionSnapshot[SceneSettings]) -> str:
    slow = ""
    if now.status.capped:
        slow = (
            f'<br><span style="color:{ink(BAD)}">This computer cannot run both robots in real time: '
            "their clock is slowed down.</span>"
        )
    return block(
        f"{badge('GHOST', GHOST)} {esc(words)}<br>translucent in the scene, dashed in the plots; it has the "
        f"same targets, pushes and clock{slow}",
        "padding-top:0.6em",
    )


def _line(name: str, mine: float, its: float, shown: Callable[[float], str]) -> str:
    cells = [
        f'<td style="text-align:right;white-space:nowrap{";font-weight:700" if better else ""}">'
        f"{shown(value)}</td>"
        for value, better in ((mine, mine < its), (its, its < mine))
    ]
    return f"<tr><td>{name}</td>{''.join(cells)}</tr>"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %"


def _milliseconds(value: float) -> str:
    return f"{value:.2f} ms"


_INTRO = block(
    "<b>A second robot does the same with other settings.</b> Choose the settings in which this ghost "
    "differs. Both robots start together, get the same targets and pushes, and share one clock. If you "
    "change another setting during the run, it changes for both robots.",
    "padding-top:0.5em",
)
