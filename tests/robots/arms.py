"""Small URDFs and independently computed references for the tests of `robots`."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots import Robot
from robots.loading.importing import import_robot

INERTIAL = (
    '<inertial><origin xyz="0.1 0 0"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LIMIT = '<limit lower="-2" upper="2" velocity="3" effort="50"/>'


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(
    name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT, axis: str = "0 1 0"
) -> str:
    axis_text = f'<axis xyz="{axis}"/>' if kind != "fixed" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.3 0 0.1"/>{axis_text}{inside}</joint>'
    )


def robot(*parts: str) -> str:
    return f'<robot name="arm">{"".join(parts)}</robot>'


def two_joint_arm(extra: str = "", j2: str | None = None, l2: str | None = None) -> str:
    """Returns the URDF of an arm base – j1 – l1 – j2 – l2 with the additional parts of a test."""
    second = joint("j2", "l1", "l2") if j2 is None else j2
    return robot(link("base"), link("l1"), l2 or link("l2"), joint("j1", "base", "l1"), second, extra)


def full_mass_matrix(model: pin.Model, q: np.ndarray) -> np.ndarray:
    upper = np.triu(pin.crba(model, model.createData(), q))
    return upper + np.triu(upper, 1).T


def load(text: str) -> Robot:
    """Loads a URDF like `load_urdf_text`, but in this process."""
    return import_robot(text.encode(), "the URDF text").used()
