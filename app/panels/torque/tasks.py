"""The stack as an ordered list: on/off, up/down, gains, weights, live error per level."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.client.wish import Wish
from app.html.palette import BAD, DAMPING, RGB, css
from app.html.text import badge, block, esc, formula, quantity, swatch
from app.panels.widgets.mirror import Bindings, scalar
from app.panels.widgets.snapshot import Snapshot
from himpc.stack import Level
from himpc.telemetry import RUNGS
from lessons.events import MoveLevel, Set
from lessons.settings.torque import TorqueSettings

_UP, _DOWN = "▲ Up", "▼ Down"


class TasksPanel:
    """One folder per level, in the order of priority."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[TorqueSettings],
        settings: TorqueSettings,
        colours: dict[str, RGB],
        current: Callable[[], TorqueSettings],
    ) -> None:
        self._current = current
        self._post = bindings.post
        self._order: Wish[tuple[str, ...]] = Wish()
        self._enabled: dict[str, Wish[bool]] = {level.name: Wish() for level in settings.levels}
        self._cards = [
            _Card(gui, bindings, level, colours, place, self._move)
            for place, level in enumerate(settings.levels)
        ]
        with gui.add_folder("Last level: damping", order=900.0):
            damping = gui.add_checkbox(
                "Damp what no level controls",
                settings.damping,
                hint="R weighs changes of torque only, so a direction without a task keeps its torque and "
                "runs away when pushed. This last level brings it to rest. Switch it off and push.",
            )
            self._damping = gui.add_html("")
        bindings.bind(damping, lambda s: s.damping, lambda on: Set("damping", bool(on)))
        with gui.add_folder("What a level minimises", expand_by_default=False, order=901.0):
            gui.add_html(formula(r"e = \ddot x - \ddot x_d + K_V (\dot x - \dot x_d) + K_P (x - x_d)"))
            gui.add_html(formula(r"\sum_j Q \lVert e_{k+j} \rVert^2 + R \lVert \Delta\tau_{k+j} \rVert^2"))
            gui.add_html(
                block(
                    "subject to every bound, and without changing any <i>e</i> of the levels above: that is "
                    "what makes the priority strict."
                )
            )

    def toggle(self, place: int) -> Set | None:
        """The event for the hotkey of a place (0-based); None if no level stands there."""
        levels = {level.name: level for level in self._current().levels}
        names = self._order.now(tuple(levels))
        if place >= len(names):
            return None
        name = names[place]
        wish = self._enabled[name]
        return Set(f"levels.{name}.enabled", wish.ask(not wish.now(levels[name].enabled)))

    def _move(self, name: str, by: int) -> None:
        """Moves a level one place up (−1) or down (+1), if there is one."""
        names = list(self._order.now(tuple(level.name for level in self._current().levels)))
        to = names.index(name) + by
        if 0 <= to < len(names):
            names.remove(name)
            names.insert(to, name)
            self._order.ask(tuple(names))
            self._post(MoveLevel(name, to))

    def update(self, now: Snapshot[TorqueSettings]) -> None:
        for place, level in enumerate(now.settings.levels):
            for card in self._cards:
                if card.name == level.name:
                    card.update(now, level, place)
        cost = now.number("cost/damping")
        busy = cost == cost
        self._damping.content = block(
            swatch(DAMPING)
            + (
                "takes part: the levels above leave freedom"
                if busy
                else "not needed: the levels above use all freedom"
                if now.settings.damping
                else "off"
            )
        )


class _Card:
    """One level."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[TorqueSettings],
        level: Level,
        colours: dict[str, RGB],
        place: int,
        shift: Callable[[str, int], None],
    ) -> None:
        name = self.name = level.name
        self._colour = colours[name]
        self._folder = gui.add_folder(_title(place, name), order=float(place))
        with self._folder:
            self._live = gui.add_html("")
            on = gui.add_checkbox("Enabled", level.enabled, hint=f"Key {place + 1}")
            move = gui.add_button_group("Priority", (_UP, _DOWN))
            with gui.add_folder("Gains and weights", expand_by_default=False):
                for task in level.tasks:
                    many = len(level.tasks) > 1
                    for field, top, step, what in (
                        ("K_p", 1000.0, 1.0, "stiffness, 1/s²"),
                        ("K_v", 100.0, 0.5, "damping, 1/s"),
                    ):
                        value = scalar(getattr(task, field))
                        self._slider(
                            gui,
                            bindings,
                            (f"{task.name} " if many else "") + ("K_P" if field == "K_p" else "K_V"),
                            f"tasks.{task.name}.{field}",
                            (0.0, max(top, value), step),
                            value,
                            _gain(name, task.name, field),
                            what,
                        )
                self._slider(
                    gui, bindings, "Q", f"levels.{name}.Q", (1.0, 1000.0, 1.0), scalar(level.Q),
                    _weight(name, "Q"), "weight of the residual",
                )  # fmt: skip
                self._slider(
                    gui, bindings, "R", f"levels.{name}.R", (0.1, 100.0, 0.1), scalar(level.R),
                    _weight(name, "R"), "weight of the changes of torque",
                )  # fmt: skip
        bindings.bind(
            on,
            lambda s: _find(s, name).enabled,
            lambda value: Set(f"levels.{name}.enabled", bool(value)),
        )

        @move.on_click
        async def _(_: object) -> None:
            shift(name, -1 if move.value == _UP else 1)

    @staticmethod
    def _slider(
        gui: viser.GuiApi,
        bindings: Bindings[TorqueSettings],
        label: str,
        path: str,
        span: tuple[float, float, float],
        value: float,
        read: Callable[[TorqueSettings], float],
        hint: str,
    ) -> None:
        low, high, step = span
        slider = gui.add_slider(
            label, min=min(low, value), max=max(high, value), step=step, initial_value=value, hint=hint
        )
        bindings.bind(slider, read, lambda number: Set(path, float(number)))

    def update(self, now: Snapshot[TorqueSettings], level: Level, place: int) -> None:
        title = _title(place, level.name)
        if self._folder.label != title:
            self._folder.label = title
            self._folder.order = float(place)
        errors = ", ".join(
            (f"{esc(task.name)} " if len(level.tasks) > 1 else "")
            + f"error <b>{quantity(now.error(task.name), task.unit)}</b>"
            for task in level.tasks
        )
        notes = "" if level.enabled else " " + badge("OFF", DAMPING)
        rung = now.number(f"rung/{level.name}")
        if level.enabled and rung == rung and rung > 0:
            notes += " " + badge(RUNGS[int(rung)], BAD)
        self._live.content = block(
            f"{swatch(self._colour)}{errors}{notes}", f"border-left:3px solid {css(self._colour)}"
        )


def _title(place: int, name: str) -> str:
    return f"{place + 1} · {name}"


def _find(settings: TorqueSettings, name: str) -> Level:
    return next(level for level in settings.levels if level.name == name)


def _weight(level: str, field: str) -> Callable[[TorqueSettings], float]:
    return lambda settings: scalar(getattr(_find(settings, level), field))


def _gain(level: str, task: str, field: str) -> Callable[[TorqueSettings], float]:
    def read(settings: TorqueSettings) -> float:
        found = next(each for each in _find(settings, level).tasks if each.name == task)
        return scalar(getattr(found, field))

    return read
