"""The cover of a robot: capsules on its bodies that contain its visual shapes and its solids. Distances for
collision avoidance are distances between capsules."""

from __future__ import annotations

from dataclasses import dataclass

from robots.geometry.collision_model import Excluded, Point, excluded_pairs


@dataclass(frozen=True)
class Capsule:
    """A capsule: all points that are nearer to a segment than a radius; a ball if the segment is a point.

    Attributes:
        joint: Pinocchio index of the joint that carries the capsule, 0 for the world.
        link: the link that the capsule belongs to, for messages.
        start, end: the ends of the segment in the joint's axes, m.
        radius: m.
    """

    joint: int
    link: str
    start: Point
    end: Point
    radius: float


@dataclass(frozen=True)
class Cover:
    """The capsules of a robot, in the order of their joints (those of the base come last), and the pairs of
    bodies whose distance is not checked. The default is a robot without capsules."""

    capsules: tuple[Capsule, ...] = ()
    excluded: tuple[Excluded, ...] = ()

    def __str__(self) -> str:
        """Returns one line for the import report."""
        if not self.capsules:
            return "the robot has no capsules: no distance is kept"
        near = sum(pair.why == "neighbours" for pair in self.excluded)
        text = f"distances use {len(self.capsules)} capsules that contain the links"
        return f"{text}; left out are {near} pair(s) of neighbours{excluded_pairs(self.excluded)}"
