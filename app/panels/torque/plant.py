"""The settings of the true plant. The controller does not know them."""

from __future__ import annotations

import viser

from app.html.text import block
from app.panels.widgets.controls import Controls
from app.panels.widgets.mirror import Bindings
from lessons.settings.torque import TorqueSettings
from robots import Robot


def add_plant(
    gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings, robot: Robot
) -> None:
    """Adds the controls of the plant's settings."""
    gui.add_html(
        block("These are the true values of the simulated robot. The controller does not know them.")
    )
    controls = Controls(gui, bindings, settings)
    controls.add("plant.payload_kg", "plant.friction", "plant.damping", "plant.armature")
    # One factor per link, named by the joint that moves the link.
    for path, title in (("mass_scale", "Mass of each link"), ("inertia_scale", "Inertia of each link")):
        controls.add(f"plant.{path}")
        controls.add_elements(f"plant.{path}", robot.joint_names, title)
    controls.add("plant.diagonal_scale", "plant.encoder_resolution_deg", "plant.torque_lag_ms")
    controls.add("plant.delay_ms", "plant.saturate", "plant.gravity")
    controls.add("plant.contacts", "plant.joint_stops")
