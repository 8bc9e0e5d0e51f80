"""What the plant really is. The controller is told none of it."""

from __future__ import annotations

import viser

from app.html.text import block
from app.panels.widgets.mirror import Bindings, scalar
from lessons.events import Set
from lessons.settings.torque import TorqueSettings
from robots import Robot

_SLIDERS = (
    # label, field, least, greatest, step, hint
    ("Payload [kg]", "payload_kg", 0.0, 10.0, 0.1, "A mass at the hand that the controller does not know"),
    ("Coulomb friction [N·m]", "friction", 0.0, 10.0, 0.1, "The same at every joint"),
    ("Viscous friction [N·m·s/rad]", "damping", 0.0, 10.0, 0.1, "The same at every joint"),
    ("Armature [kg·m²]", "armature", 0.0, 1.0, 0.01, "Reflected inertia of the motors"),
    ("Mass scale", "mass_scale", 0.2, 3.0, 0.05, "Factor on the mass of every link"),
    ("Inertia scale", "inertia_scale", 0.2, 3.0, 0.05, "Factor on the rotational inertia of every link"),
    (
        "M(q) diagonal scale",
        "diagonal_scale",
        0.5,
        2.0,
        0.05,
        "Factor on the diagonal of M(q) alone, the letter of the paper's Table V: no real arm is like this",
    ),
    (
        "Encoder [10⁻³ °]",
        "encoder_resolution_deg",
        0.0,
        20.0,
        0.25,
        "Resolution of the joint sensors, 0: ideal",
    ),
    ("Torque lag [ms]", "torque_lag_ms", 0.0, 20.0, 0.5, "First-order lag of the motors"),
    ("Delay [ms]", "delay_ms", 0.0, 10.0, 0.5, "From command to torque"),
)
_PER_LINK = {"mass_scale": "Mass of each link", "inertia_scale": "Inertia of each link"}
_UNIT = {"encoder_resolution_deg": 1e3}


class PlantPanel:
    """Sliders of the plant's settings."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings, robot: Robot
    ) -> None:
        gui.add_html(block("This is the truth in the simulation. The controller sees none of it."))
        for label, field, low, high, step, hint in _SLIDERS:
            unit = _UNIT.get(field, 1.0)
            value = _shown(settings, field, unit)
            slider = gui.add_slider(
                label, min=min(low, value), max=max(high, value), step=step, initial_value=value, hint=hint
            )
            bindings.bind(
                slider,
                lambda s, field=field, unit=unit: _shown(s, field, unit),
                lambda number, field=field, unit=unit: Set(f"plant.{field}", float(number) / unit),
            )
            if field in _PER_LINK:
                _per_link(gui, bindings, settings, robot, field, low, high, step)
        for label, field, hint in (
            ("Motors saturate", "saturate", "Clip the torque at the data sheet's limits"),
            ("Gravity", "gravity", "Off: a weightless plant"),
        ):
            box = gui.add_checkbox(label, bool(getattr(settings.plant, field)), hint=hint)
            bindings.bind(
                box,
                lambda s, field=field: bool(getattr(s.plant, field)),
                lambda on, field=field: Set(f"plant.{field}", bool(on)),
            )


def _per_link(
    gui: viser.GuiApi,
    bindings: Bindings[TorqueSettings],
    settings: TorqueSettings,
    robot: Robot,
    field: str,
    low: float,
    high: float,
    step: float,
) -> None:
    """The same factor link by link, named by the joint that moves it."""

    def shown(settings: TorqueSettings, joint: int) -> float:
        values = getattr(settings.plant, field)
        return float(values[joint] if isinstance(values, tuple) else values)

    with gui.add_folder(_PER_LINK[field], expand_by_default=False):
        for joint, name in enumerate(robot.joint_names):
            value = shown(settings, joint)
            number = gui.add_number(name, value, min=min(low, value), max=max(high, value), step=step)
            bindings.bind(
                number,
                lambda s, joint=joint: shown(s, joint),
                lambda factor, joint=joint: Set(f"plant.{field}.{joint + 1}", float(factor)),
            )


def _shown(settings: TorqueSettings, field: str, unit: float) -> float:
    return round(scalar(getattr(settings.plant, field)) * unit, 9)
