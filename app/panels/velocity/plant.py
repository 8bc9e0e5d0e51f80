"""The settings of the true velocity-controlled plant. The controller knows at most its lag."""

from __future__ import annotations

import viser

from app.html.text import block
from app.panels.widgets.controls import Controls
from app.panels.widgets.mirror import Bindings
from lessons.settings.velocity import VelocitySettings

_SHOWN = (
    "mode", "bandwidth", "lag_ms", "delay_ms", "position_noise", "velocity_noise", "payload_kg", "friction",
    "damping", "saturate",
)  # fmt: skip


def add_servo_plant(
    gui: viser.GuiApi, bindings: Bindings[VelocitySettings], settings: VelocitySettings
) -> None:
    """Adds the controls of the plant's settings."""
    gui.add_html(
        block("These are the true values of the simulated robot. The controller knows at most the lag.")
    )
    Controls(gui, bindings, settings).add(*(f"plant.{name}" for name in _SHOWN))
