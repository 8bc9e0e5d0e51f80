"""The robot: its description, the catalog of robots, and the simulated plant."""

from typing import TYPE_CHECKING

from robots.lazy import lazily

if TYPE_CHECKING:
    from robots.catalog import CATALOG
    from robots.collision import Ball, Box, Floor
    from robots.errors import InputError
    from robots.inertia import convergence_eigenvalues, convergence_gauge, suggest_M_bar, tracking_bandwidth
    from robots.loading.load import check_urdf, load_robot, load_urdf_text
    from robots.nominal import NominalModel, NominalSettings
    from robots.plant import Plant
    from robots.report import Finding, ImportReport
    from robots.robot import Robot
    from robots.servo import VelocityPlant, VelocityPlantSettings
    from robots.settings import PlantSettings
    from robots.signals import PlantState

__all__ = [
    "CATALOG",
    "Ball",
    "Box",
    "Finding",
    "Floor",
    "ImportReport",
    "InputError",
    "NominalModel",
    "NominalSettings",
    "Plant",
    "PlantSettings",
    "PlantState",
    "Robot",
    "VelocityPlant",
    "VelocityPlantSettings",
    "check_urdf",
    "convergence_eigenvalues",
    "convergence_gauge",
    "load_robot",
    "load_urdf_text",
    "suggest_M_bar",
    "tracking_bandwidth",
]

__getattr__ = lazily("robots")
