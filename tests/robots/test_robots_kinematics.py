"""The kinematics of every catalog robot agree with an independent URDF library."""

from __future__ import annotations

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from robots import CATALOG, load_robot


@pytest.mark.parametrize("name", CATALOG)
def test_every_link_is_where_another_reader_puts_it(name: str) -> None:
    """At random configurations, yourdfpy and Pinocchio give the same pose of every link of the canonical
    URDF."""
    robot = load_robot(name)
    other = yourdfpy.URDF.load(io.StringIO(robot.urdf_text), load_meshes=False, build_scene_graph=True)
    data = robot.model.createData()
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = rng.uniform(np.maximum(robot.q_lower, -3.0), np.minimum(robot.q_upper, 3.0))
        other.update_cfg(dict(zip(robot.joint_names, q, strict=True)))
        pin.framesForwardKinematics(robot.model, data, q)
        for link in robot.frames:
            placed = data.oMf[robot.frame_id(link)].homogeneous
            np.testing.assert_allclose(other.get_transform(link), placed, atol=1e-9, err_msg=link)
