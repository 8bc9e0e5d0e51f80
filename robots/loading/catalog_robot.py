"""The robots of the catalog, also with joints that are held and with a tool on the tip: home, M̄ and shapes
are always those of the catalog."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin
from lxml import etree

from robots.catalog import CatalogEntry
from robots.covering.covers import checked
from robots.geometry import Capsule, CollisionModel, Cover, Excluded, Point, Solid, point, stored
from robots.joints import joint_names
from robots.loading.importing import Import, bounds
from robots.mechanics.exclusions import collision_model
from robots.robot import Robot
from robots.urdf import canonicalise, load_bytes
from robots.urdf.structure import HOME
from robots.urdf.tip import TOOL

Places = list[tuple[int, pin.SE3]]
"""For each body of the whole robot, the body that carries it and its placement on this body."""


def catalog_robot(entry: CatalogEntry, tip: str | None = None, hold: tuple[str, ...] = ()) -> Robot:
    """Returns a robot of the catalog; tip and hold: see `load_robot`. A pattern without a value holds a joint
    where the catalog's home has it.

    M̄ of the other joints remains right: without the rows and columns of the held joints, M⁻¹M̄ has no larger
    eigenvalue.

    Raises InputError for an unknown tip, for a pattern that fits no joint, and if all joints are held.
    """
    data = load_bytes(entry.path)
    whole = _read(entry, data, entry.tip if hold else tip, (), None)
    return _with_shapes(_read(entry, _with_home(whole), tip, hold, whole), whole) if hold else whole


def _read(
    entry: CatalogEntry, data: bytes, tip: str | None, hold: tuple[str, ...], whole: Robot | None
) -> Robot:
    """Returns the robot with the catalog's data. whole: the robot with all joints, None if none is held."""
    asked = entry.tip if tip is None else entry.tip + tip if tip.startswith(TOOL) else tip
    canonical, report = canonicalise(data, f"robots/{entry.name}", entry.path.parent, tip=asked, hold=hold)
    if canonical is None:
        return Import(report).used()
    model = canonical.model
    names, (lower, upper) = joint_names(model), bounds(model)
    kept = [names.index(name) if whole is None else whole.joint_names.index(name) for name in names]
    return Robot(
        name=entry.name,
        model=model,
        joint_names=names,
        tip=report.tip,
        home=entry.home[kept],
        q_lower=lower,
        q_upper=upper,
        v_limit=model.velocityLimit,
        tau_limit=model.effortLimit,
        a_max=np.array(entry.a_max)[kept],
        M_bar=np.array(entry.M_bar)[kept],
        urdf_text=canonical.text,
        report=report,
        collision=stored(CollisionModel, entry.collision_path),
        cover=stored(Cover, entry.cover_path),
    )


def _with_home(whole: Robot) -> bytes:
    """Returns the description of a robot, in which each joint has its value at home."""
    root = etree.fromstring(whole.urdf_text)
    joints = {joint.get("name"): joint for joint in root.iterfind("joint")}
    for name, value in zip(whole.joint_names, whole.home, strict=True):
        joints[name].set(HOME, repr(float(value)))
    return etree.tostring(root)


def _with_shapes(robot: Robot, whole: Robot) -> Robot:
    """Returns a robot with held joints with the shapes of the whole robot. To the pairs that the whole robot
    leaves out, those are added that touch where the joints are held."""
    assert whole.cover is not None
    places = [(0, pin.SE3.Identity())] * whole.model.njoints
    for name in whole.frames:
        old, new = whole.model.frames[whole.frame_id(name)], robot.model.frames[robot.frame_id(name)]
        if old.parentJoint > 0:
            places[old.parentJoint] = new.parentJoint, new.placement * old.placement.inverse()
    solids = sorted((_solid(each, places) for each in whole.collision.solids), key=_last_the_base)
    capsules = sorted((_capsule(each, places) for each in whole.cover.capsules), key=_last_the_base)
    known = _pairs(whole.collision.excluded, places)
    collision = collision_model(robot, tuple(solids))
    collision = replace(collision, excluded=_together(known, collision.excluded))
    robot = replace(robot, collision=collision)
    cover = checked(robot, tuple(capsules))
    known = _pairs(whole.cover.excluded, places)
    return replace(robot, cover=replace(cover, excluded=_together(known, cover.excluded)))


def _solid(solid: Solid, places: Places) -> Solid:
    joint, place = places[solid.joint]
    w, x, y, z = solid.quaternion
    i, j, k, real = (pin.Quaternion(place.rotation) * pin.Quaternion(w, x, y, z)).coeffs()
    return replace(
        solid,
        joint=joint,
        position=_point(place, solid.position),
        quaternion=(float(real), float(i), float(j), float(k)),
        points=tuple(_point(place, corner) for corner in solid.points),
    )


def _capsule(capsule: Capsule, places: Places) -> Capsule:
    joint, place = places[capsule.joint]
    return replace(capsule, joint=joint, start=_point(place, capsule.start), end=_point(place, capsule.end))


def _point(place: pin.SE3, at: Point) -> Point:
    return point(place.act(np.array(at)))


def _last_the_base(shape: Solid | Capsule) -> tuple[bool, int]:
    return shape.joint == 0, shape.joint


def _pairs(excluded: Iterable[Excluded], places: Places) -> Iterator[Excluded]:
    """Yields the pairs of different bodies that are left of the whole robot's pairs."""
    for pair in excluded:
        first, second = sorted((places[pair.first][0], places[pair.second][0]))
        if first < second:
            turned = places[pair.first][0] > places[pair.second][0]
            yield replace(pair, first=first, second=second, names=pair.names[:: -1 if turned else 1])


def _together(*several: Iterable[Excluded]) -> tuple[Excluded, ...]:
    """Returns all pairs, each once."""
    found: dict[tuple[int, int], Excluded] = {}
    for pair in (pair for pairs in several for pair in pairs):
        found.setdefault((pair.first, pair.second), pair)
    return tuple(found.values())
