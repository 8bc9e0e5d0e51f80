"""The settings of the true velocity-controlled plant. The controller knows at most its lag."""

from __future__ import annotations

from app.html.text import block
from app.panels.widgets.controls import Controls
from app.tab.context import PageContext


def add_servo_plant(page: PageContext) -> None:
    """Adds the controls of the plant's settings."""
    page.gui.add_html(
        block("These are the true values of the simulated robot. The controller knows at most the lag.")
    )
    Controls(page.gui, page.bindings, page.settings).add_group("Plant")
