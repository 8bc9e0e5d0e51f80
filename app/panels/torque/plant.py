"""The settings of the true plant. The controller does not know them."""

from __future__ import annotations

import viser

from app.html.text import block, joint_labels
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
    # One factor per link, named by the joint that moves the link.
    links = {"plant.mass_scale": "Mass of each link", "plant.inertia_scale": "Inertia of each link"}
    Controls(gui, bindings, settings).add_group("Plant", links, joint_labels(robot.joint_names))
