"""The collision geometry of a robot as data: convex solids on its bodies, and the pairs of bodies whose
contact is left out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float, float]
SolidKind = Literal["box", "sphere", "cylinder", "capsule", "hull"]
Why = Literal["neighbours", "home", "always", "hollow", "cover"]
Source = Literal["collision", "hull", "capsule"]


@dataclass(frozen=True)
class Solid:
    """A convex solid that is fixed to a body of a robot.

    Attributes:
        joint: Pinocchio index of the joint that carries the solid, 0 for the world.
        link: the link that the solid belongs to, for messages.
        kind: the shape. source: "collision", a collision shape of the URDF; "hull", the convex hull of the
            link's visual shapes; "capsule", generated along the kinematics.
        size: m; half the edges of a box, (radius,) of a sphere, (radius, half the length of the straight
            part) of a cylinder or capsule along z, () for a hull.
        position: the middle in the joint's axes, m.
        quaternion: orientation of the solid relative to the joint's axes, (w, x, y, z).
        points: for a hull, the corners in the joint's axes, m.
    """

    joint: int
    link: str
    kind: SolidKind
    source: Source
    size: tuple[float, ...] = ()
    position: Point = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    points: tuple[Point, ...] = ()


@dataclass(frozen=True)
class Excluded:
    """Two bodies whose contact is left out: first < second, Pinocchio indices of their joints, 0 for the
    base.

    names: one link of each body. why: one of these words:

    - "neighbours": a joint connects them;
    - "home": they touch at home;
    - "always": they touch in nearly every posture;
    - "hollow": their hulls fill hollows of the links, and touch in postures in which the links do not touch;
    - "cover": only their capsules touch, in many postures.
    """

    first: int
    second: int
    names: tuple[str, str]
    why: Why


@dataclass(frozen=True)
class CollisionModel:
    """The solids of a robot, in the order of their joints (those of the base come last), and the pairs of
    bodies whose contact is left out. The default is a robot without solids."""

    solids: tuple[Solid, ...] = ()
    excluded: tuple[Excluded, ...] = ()

    def __str__(self) -> str:
        """Returns one line for the import report."""
        if not self.solids:
            return "the robot has no shape: it touches nothing"
        words = {
            "collision": "{} collision shape(s) of the URDF",
            "hull": "{} convex hull(s) of visual shapes",
            "capsule": "{} generated capsule(s)",
        }
        counts = Counter(solid.source for solid in self.solids)
        parts = [text.format(counts[source]) for source, text in words.items() if counts[source]]
        near = sum(pair.why == "neighbours" for pair in self.excluded)
        text = f"contacts use {', '.join(parts)}; left out are {near} pair(s) of neighbours"
        return text + excluded_pairs(self.excluded)


_SHOWN = 8
_TOLD = (
    ("home", "touch at home"),
    ("always", "touch in nearly every posture"),
    ("hollow", "touch only as convex hulls"),
    ("cover", "touch only as capsules"),
)


def excluded_pairs(excluded: tuple[Excluded, ...]) -> str:
    """Returns the end of a sentence of the import report: the pairs that are left out, except neighbours."""
    text = ""
    for why, said in _TOLD:
        pairs = [" – ".join(pair.names) for pair in excluded if pair.why == why]
        shown = ", ".join(pairs[:_SHOWN]) + (f" and {len(pairs) - _SHOWN} more" if pairs[_SHOWN:] else "")
        text += f", and {shown}, which {said}" if pairs else ""
    return text
