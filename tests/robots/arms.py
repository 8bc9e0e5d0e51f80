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


def load(text: str, tip: str | None = None) -> Robot:
    """Loads a URDF like `load_urdf_text`, but in this process."""
    return import_robot(text.encode(), "the URDF text", tip=tip).used()


def humanoid() -> str:
    """Returns a small humanoid with 29 joints, as many as a Unitree G1: two legs of 6, a waist of 3, two arms
    of 7."""
    axes = ("1 0 0", "0 1 0", "0 0 1")

    def limb(parent: str, names: list[str], at: str, along: str) -> str:
        parts, here = "", parent
        for place, name in enumerate(names):
            solid = (
                f'<inertial><origin xyz="{along}"/><mass value="{1.5 - 0.1 * place}"/><inertia ixx="0.01" '
                'iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
            )
            parts += f'<link name="{name}_link">{solid}</link><joint name="{name}_joint" type="revolute">'
            parts += (
                f'<parent link="{here}"/><child link="{name}_link"/><origin xyz="{along if place else at}"/>'
            )
            parts += f'<axis xyz="{axes[place % 3]}"/><limit lower="-2" upper="2" velocity="6" effort="80"/>'
            parts += "</joint>"
            here = f"{name}_link"
        return parts

    leg = ["hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll"]
    arm = [
        "shoulder_pitch",
        "shoulder_roll",
        "shoulder_yaw",
        "elbow",
        "wrist_roll",
        "wrist_pitch",
        "wrist_yaw",
    ]
    parts = [link("pelvis"), limb("pelvis", ["waist_yaw", "waist_roll", "torso"], "0 0 0.1", "0 0 0.1")]
    for side, y in (("left", 0.15), ("right", -0.15)):
        parts.append(limb("pelvis", [f"{side}_{name}" for name in leg], f"0 {y} 0", "0 0 -0.13"))
        parts.append(limb("torso_link", [f"{side}_{name}" for name in arm], f"0 {y} 0.2", "0.05 0 -0.08"))
        parts.append(link(f"{side}_hand", ""))
        parts.append(joint(f"{side}_hand_joint", f"{side}_wrist_yaw_link", f"{side}_hand", "fixed", ""))
    return robot(*parts)
