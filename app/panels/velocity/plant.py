"""What the velocity-controlled plant really is. The controller is told its lag at most."""

from __future__ import annotations

import viser

from app.html.text import block
from app.panels.widgets.mirror import Bindings, scalar
from app.panels.widgets.sliders import add_box, add_menu, add_slider
from lessons.settings.velocity import VelocitySettings
from robots.servo import MODES

_SLIDERS = (
    # label, field, span, unit, hint
    ("Bandwidth [1/s]", "bandwidth", (1, 300, 1), 1.0, "Of the velocity servos (servo plant)"),
    ("Lag [ms]", "lag_ms", (0, 300, 5), 1.0, "First-order lag between command and servo"),
    ("Delay [ms]", "delay_ms", (0, 300, 5), 1.0, "A command acts this much later"),
    ("Position noise [10⁻³]", "position_noise", (0, 10, 0.1), 1e3, "Standard deviation, rad and m"),
    ("Velocity noise [10⁻³]", "velocity_noise", (0, 100, 1), 1e3, "Standard deviation, rad/s and m/s"),
    ("Payload [kg]", "payload_kg", (0, 10, 0.5), 1.0, "A mass at the hand (servo plant)"),
    ("Coulomb friction [N·m]", "friction", (0, 20, 0.5), 1.0, "The same at every joint (servo plant)"),
    ("Viscous friction", "damping", (0, 20, 0.5), 1.0, "N·m·s/rad, the same at every joint (servo plant)"),
)


class ServoPanel:
    """Controls of the plant's settings."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[VelocitySettings], settings: VelocitySettings
    ) -> None:
        gui.add_html(
            block("This is the truth in the simulation. Of it the controller knows the lag at most.")
        )
        add_menu(
            gui,
            bindings,
            settings,
            "Plant",
            "plant.mode",
            MODES,
            lambda s: s.plant.mode,
            "ideal: the command is met exactly. servo: MuJoCo's mechanics under joint velocity servos",
        )
        for label, field, span, unit, hint in _SLIDERS:
            add_slider(
                gui,
                bindings,
                settings,
                label,
                f"plant.{field}",
                span,
                lambda s, field=field: scalar(getattr(s.plant, field)),
                hint,
                unit=unit,
            )
        add_box(
            gui,
            bindings,
            settings,
            "Motors saturate",
            "plant.saturate",
            lambda s: s.plant.saturate,
            "Clip the servos' torque at the data sheet's limits",
        )
