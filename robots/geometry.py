"""The geometry of a robot as data: convex solids for contacts, capsules for distances, the pairs of bodies
that are left out, the surfaces that are drawn, and the files of the catalog."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_type_hints

import numpy as np

Point = tuple[float, float, float]


def point(numbers: np.ndarray) -> Point:
    """Returns an array of three numbers as a point."""
    x, y, z = numbers
    return float(x), float(y), float(z)


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
        return f"contacts use {', '.join(parts)}; {_left_out(self.excluded)}"


_SHOWN = 8
_TOLD = (
    ("home", "touch at home"),
    ("always", "touch in nearly every posture"),
    ("hollow", "touch only as convex hulls"),
    ("cover", "touch only as capsules"),
)


def _left_out(excluded: tuple[Excluded, ...]) -> str:
    """Returns the end of a sentence of the import report: the pairs that are left out."""
    near = sum(pair.why == "neighbours" for pair in excluded)
    text = f"left out are {near} pair(s) of neighbours"
    for why, said in _TOLD:
        pairs = [" – ".join(pair.names) for pair in excluded if pair.why == why]
        shown = ", ".join(pairs[:_SHOWN]) + (f" and {len(pairs) - _SHOWN} more" if pairs[_SHOWN:] else "")
        text += f", and {shown}, which {said}" if pairs else ""
    return text


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
        text = f"distances use {len(self.capsules)} capsules that contain the links"
        return f"{text}; {_left_out(self.excluded)}"


Geometry = TypeVar("Geometry", CollisionModel, Cover)


def stored(kind: type[Geometry], path: Path) -> Geometry:
    """Reads the collision geometry or the cover of a robot."""
    data = json.loads(path.read_text())
    parts = {name: get_args(hint)[0] for name, hint in get_type_hints(kind).items()}
    return kind(
        **{
            name: tuple(part(**{key: _frozen(value) for key, value in each.items()}) for each in data[name])
            for name, part in parts.items()
        }
    )


def as_json(geometry: CollisionModel | Cover) -> str:
    """Returns the text of the file that `stored` reads, with one line per solid, capsule or pair."""
    lists = (
        f'"{field.name}": [\n  '
        + ",\n  ".join(json.dumps(asdict(each)) for each in getattr(geometry, field.name))
        + "]"
        for field in fields(geometry)
    )
    return "{" + ",\n".join(lists) + "}\n"


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


@dataclass(frozen=True, eq=False)
class Shape:
    """One coloured piece of a robot's surface.

    joint: the Pinocchio joint to which the piece is fixed, 0 = the world; vertices (V, 3) float32, m, in the
    joint's frame; faces (F, 3) int32, counter-clockwise seen from outside; colour 0–255; name: unique. Faces
    share vertices only where the surface is smooth: averaged vertex normals can be used for shading.
    """

    joint: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: tuple[int, int, int]
    name: str


@lru_cache(maxsize=4)
def directions(count: int) -> np.ndarray:
    """Returns unit vectors (count, 3) that are evenly spread on a spiral over the sphere."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
