"""The settings one most often compares, with values worth trying; the first one is seldom a scene's own."""

from __future__ import annotations

from dataclasses import dataclass

from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS
from lessons.kinds import AnySettings
from lessons.settings.torque import SceneSettings


@dataclass(frozen=True)
class Choice:
    """A path of `himpc-lab run --set`, its name for people, and values worth trying as typed."""

    path: str
    words: str
    values: tuple[str, ...]


def usual_settings(settings: AnySettings) -> tuple[Choice, ...]:
    """What can usually be compared in a scene; the controllers are apart."""
    if not isinstance(settings, SceneSettings):
        return _MOBILE
    levels = [level.name for level in settings.levels]
    return (
        Choice("horizon", "horizon N", ("1", "2", "5", "10", "20")),
        Choice("M_bar_scale", "M̄ scale", ("4", "2", "1", "0.5")),
        *(Choice(f"levels.{name}.enabled", f"level {name} on", ("false", "true")) for name in levels),
        *(Choice(f"levels.{name}.Q", f"Q of {name}", ("20", "100", "200", "500", "2000")) for name in levels),
        *(Choice(f"levels.{name}.R", f"R of {name}", ("1", "10", "100", "1000")) for name in levels),
        Choice("plant.payload_kg", "payload, kg", ("3", "1", "2", "5", "0")),
        Choice("plant.inertia_scale", "true inertias ×", ("0.8", "1.2", "1")),
        Choice("plant.encoder_resolution_deg", "encoder resolution, °", ("0.005", "0.001", "0.01", "0")),
        Choice("plant.delay_ms", "delay of the torque, ms", ("1", "2", "0")),
        Choice("plant.saturate", "torque bound of the motors", ("false", "true")),
        Choice("limits.position", "position limits", ("paper", "off", "viability")),
        Choice("damping", "damping level", ("false", "true")),
        Choice("T_s", "control period T_s, s", ("0.002", "0.004", "0.001")),
    )


_MOBILE = (
    Choice("horizon", "horizon N", ("5", "10", "20")),
    Choice("compensate_delay", "delay compensated", ("false", "true")),
)


def controllers_for(settings: AnySettings) -> tuple[str, ...]:
    """Names of the controllers that fit a scene."""
    return tuple(CONTROLLERS if isinstance(settings, SceneSettings) else VELOCITY_CONTROLLERS)
