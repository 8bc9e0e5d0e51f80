"""The settings one most often compares, with values worth trying; the first one is seldom a scene's own."""

from __future__ import annotations

from dataclasses import dataclass

from lessons.settings.settings import Settings


@dataclass(frozen=True)
class Choice:
    """A path of `himpc-lab run --set`, its name for people, and values worth trying as typed."""

    path: str
    words: str
    values: tuple[str, ...]


def usual_settings(settings: Settings) -> tuple[Choice, ...]:
    """What can usually be compared in a scene; the controllers are apart."""
    levels = [level.name for level in settings.levels]
    choices = (
        Choice("horizon", "horizon N", ("1", "2", "5", "10", "20")),
        Choice("M_bar_scale", "M̄ scale", ("4", "2", "1", "0.5")),
        *(Choice(f"levels.{name}.enabled", f"level {name} on", ("false", "true")) for name in levels),
        *(Choice(f"levels.{name}.Q", f"Q of {name}", ("20", "100", "200", "500", "2000")) for name in levels),
        *(Choice(f"levels.{name}.R", f"R of {name}", ("1", "10", "100", "1000")) for name in levels),
        Choice("plant.payload_kg", "payload, kg", ("3", "1", "2", "5", "0")),
        Choice("plant.inertia_scale", "true inertias ×", ("0.8", "1.2", "1")),
        Choice("plant.encoder_resolution_deg", "encoder resolution, °", ("0.005", "0.001", "0.01", "0")),
        Choice("plant.delay_ms", "delay of the command, ms", ("1", "2", "0")),
        Choice("plant.saturate", "torque bound of the motors", ("false", "true")),
        Choice("limits.position", "position limits", ("paper", "off", "viability")),
        Choice("damping", "damping level", ("false", "true")),
        Choice("T_s", "control period T_s, s", ("0.002", "0.004", "0.001")),
        Choice("compensate_delay", "delay compensated", ("false", "true")),
        Choice("delta_m", "δ of (13), m", ("0.002", "0.02", "0.05")),
    )
    known = settings.places()
    return tuple(choice for choice in choices if choice.path in known)
