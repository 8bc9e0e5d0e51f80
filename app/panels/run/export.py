"""Downloads: telemetry rows, plots, and the setting."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from app.client.rows import RATE
from app.client.simulation import Simulation
from app.html.text import block
from app.panels.context import PageContext
from lessons.plots.recorded import Recorded, run_picture
from lessons.recording.arrays import as_csv, as_npz, named

_MINUTE, _WHOLE = "the last minute", "all since the last reset"


class ExportPanel:
    """The panel of downloads. Files are made from the recorded data, on viser's threads and without the
    simulation."""

    def __init__(self, page: PageContext) -> None:
        gui, self._page, self._learner = page.gui, page, page.learner
        gui.add_html(_INTRO)
        self._span = gui.add_dropdown("Of", (_MINUTE, _WHOLE), initial_value=_MINUTE)
        for label, make, hint in (
            ("Rows as .npz", self._npz, "NumPy arrays with the same names as from himpc-lab run --npz"),
            ("Rows as .csv", self._csv, "One line per row, for a spreadsheet; SI units"),
            (
                "Plots as .png",
                self._png,
                "Errors, joints with their bounds, and computing time; curves of the ghost are dashed",
            ),
        ):
            self._button(gui, label, make, hint)

    def _button(
        self, gui: viser.GuiApi, label: str, make: Callable[[], tuple[str, bytes] | None], hint: str
    ) -> None:
        button = gui.add_button(label, hint=hint)

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:  # on a thread, as it takes seconds
            client = event.client
            if client is None:
                return
            made = make()
            if made is None:
                client.add_notification("Nothing recorded yet", "Let the robot run first.", color="orange")
                return
            client.send_file_download(*made, save_immediately=True)

    def _rows(self, simulation: Simulation) -> Recorded | None:
        record = simulation.record
        if record is None:
            return None
        # The page's loop may append rows at the same time.
        rows = simulation.read(lambda *_: record.recent() if self._span.value == _MINUTE else record.whole())
        return None if rows is None or len(rows) < 2 else Recorded(record.layout, rows)

    def _name(self, ending: str) -> str:
        return f"{self._learner.choice.run.scene}-{self._page.settings.controller}.{ending}"

    def _npz(self) -> tuple[str, bytes] | None:
        run, ready = self._rows(self._learner), self._learner.ready
        if run is None or ready is None:
            return None
        spec, gap = self._learner.choice.run, np.diff(run["t"][:, 0])
        how = {
            "scene": spec.scene,
            "urdf": spec.urdf,
            "tip": spec.tip,
            "hold": list(spec.hold),
            "seed": spec.seed,
            "rows_per_second": float(1 / np.median(gap)),
        }
        return self._name("npz"), as_npz(named(ready.robot, self._page.settings, run.layout, run.rows, how))

    def _csv(self) -> tuple[str, bytes] | None:
        run = self._rows(self._learner)
        return None if run is None else (self._name("csv"), as_csv(run.layout, run.rows))

    def _png(self) -> tuple[str, bytes] | None:
        run = self._rows(self._learner)
        if run is None:
            return None
        from lessons.plots.draw import draw  # late, as few pages make plots, and Matplotlib is large

        ghost = self._learner.ghost
        beside = None if ghost is None else self._rows(ghost)
        name = self._name("png")
        with tempfile.TemporaryDirectory() as folder:
            picture = run_picture(name.removesuffix(".png"), run, beside, self._page.settings.T_s)
            return name, draw(picture, Path(folder)).read_bytes()


_INTRO = block(
    f"<b>Download the run.</b> The page stores up to {RATE:g} rows per second, each exactly as the "
    "simulation wrote it. Of a long run, the page stores every second, fourth, … of these rows.",
    "padding-top:0.5em",
)
