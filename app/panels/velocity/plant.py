"""The settings of the true velocity-controlled plant. The controller knows at most its lag."""

from __future__ import annotations

import viser

from app.html.text import block
from app.panels.widgets.controls import Controls
from app.panels.widgets.mirror import Bindings
from lessons.settings.velocity import VelocitySettings


def add_servo_plant(
    gui: viser.GuiApi, bindings: Bindings[VelocitySettings], settings: VelocitySettings
) -> None:
    """Adds the controls of the plant's settings."""
    gui.add_html(
        block("These are the true values of the simulated robot. The controller knows at most the lag.")
    )
    Controls(gui, bindings, settings).add_group("Plant")
