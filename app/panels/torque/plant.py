"""The settings of the true plant. The controller does not know them."""

from __future__ import annotations

from app.html.text import block, joint_labels
from app.panels.widgets.controls import Controls
from app.tab.context import PageContext


def add_plant(page: PageContext) -> None:
    """Adds the controls of the plant's settings."""
    page.gui.add_html(
        block("These are the true values of the simulated robot. The controller does not know them.")
    )
    # One factor per link, named by the joint that moves the link.
    links = {"plant.mass_scale": "Mass of each link", "plant.inertia_scale": "Inertia of each link"}
    controls = Controls(page.gui, page.bindings, page.settings)
    controls.add_group("Plant", links, joint_labels(page.robot.joint_names))
