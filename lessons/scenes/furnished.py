"""Arms among objects: a table and a post, and a post alone."""

from __future__ import annotations

from dataclasses import replace

from lessons.scenes.hold import hold_of
from lessons.scenes.torque_scene import TorqueScene
from robots.world import Ball, Post, Thing, World, table

TABLE_HEIGHT = 0.2
"""Height of the surface of the table, m."""
_BALL_RADIUS = 0.05


def iiwa14_table() -> TorqueScene:
    """The iiwa in front of a table and beside a post; a ball of 0.3 kg lies on the table."""
    ball = Ball("ball", (0.6, 0.3, TABLE_HEIGHT + _BALL_RADIUS), _BALL_RADIUS)
    things = (
        table("table", (0.7, 0.0), (0.6, 0.9), TABLE_HEIGHT),
        Thing(Post("post", (0.3, -0.25, 0.0), 0.9, 0.04)),
        Thing(ball, mass_kg=0.3),
    )
    return _with("iiwa14", "table", things)


def panda_post() -> TorqueScene:
    """The Panda beside a post."""
    return _with("panda", "post", (Thing(Post("post", (0.3, -0.25, 0.0), 0.9, 0.04)),))


def _with(robot: str, what: str, things: World) -> TorqueScene:
    scene = hold_of(robot)
    return replace(
        scene,
        name=f"{robot}-{what}",
        title=f"{scene.title}; with a {what}",
        world=(*scene.world, *things),
    )
