"""Makes the inertias of a URDF physical: every moving body gets a positive mass and a physically possible
inertia."""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.report import Finding
from robots.urdf.read import Refusal, end_of, label, named, numbers, placement
from robots.urdf.structure import body_of, followers, movable_joints

_DENSITY = 1000.0  # kg/m³: density of the solids that replace missing masses and inertias
_LEAST_MASS = 1e-6  # kg
_FILL_MASS = 0.1  # kg: mass that a moving body without mass, shapes and length gets
_SLENDER = 8.0  # length of a limb divided by its radius
_HEAVIEST = 1e4  # kg: a heavier solid means that the shape has another unit
_MARGIN = 1e-9  # distance of a repaired inertia from the limit of physical inertias, as a share of the trace
ASSUMED = "assumed"
"""Attribute of an inertia that the file does not give; the canonical form does not have it."""
_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def repair_inertials(root: Element) -> Iterator[Finding]:
    """Repairs the inertia of every link, then gives mass to moving bodies that have none.

    Raises no exception. For an inertial element that cannot be read, a `refused` finding is yielded.
    """
    masses: dict[str, float] = {}
    for name, link in named(root, "link").items():
        try:
            masses[name] = yield from _repair_link(link)
        except Refusal as refusal:
            masses[name] = 1.0
            yield refusal.finding
    links = named(root, "link")
    total: dict[str, float] = {}
    for name, first in body_of(root).items():
        total[first] = total.get(first, 0.0) + masses[name]
    for joint in (*movable_joints(root), *followers(root)):
        carried = end_of(joint, "child")
        if total[carried] <= 0.0:
            try:
                found, solid = _from_shapes(root, carried)
            except Refusal as refusal:
                yield refusal.finding
                continue
            _write(links[carried], found)
            text = (
                f"the body moved by {label(joint)} has no mass; {solid} of {found.mass:.3g} kg was put there"
            )
            yield Finding("filled", label(links[carried]), text)


def lighten(root: Element, share: float) -> None:
    """Multiplies the masses and inertias that the file does not give."""
    for inertial in root.iterfind(f"link/inertial[@{ASSUMED}]"):
        for tag, keys in (("mass", ("value",)), ("inertia", _KEYS)):
            for element in inertial.findall(tag):
                for key in keys:
                    element.set(key, repr(share * float(element.get(key, "0"))))


def _from_shapes(root: Element, carried: str) -> tuple[pin.Inertia, str]:
    """Returns the inertia that a link without mass gets, and what it is the inertia of: the simple shapes of
    its collision geometry, or of its visual geometry, or a cylinder that reaches from its joint to the
    farthest joint that it carries."""
    link = named(root, "link")[carried]
    for tag in ("collision", "visual"):
        parts = [part for shape in link.findall(tag) if (part := _solid(shape)) is not None]
        whole = reduce(lambda one, other: one + other, parts, pin.Inertia.Zero())
        if whole.mass >= _LEAST_MASS:
            return whole, "the solid of its shapes"
    ends = [
        placement(joint).translation for joint in root.findall("joint") if end_of(joint, "parent") == carried
    ]
    end = max(ends, key=np.linalg.norm, default=np.zeros(3))
    length = float(np.linalg.norm(end))
    radius = length / _SLENDER
    mass = _DENSITY * np.pi * radius**2 * length
    if not _LEAST_MASS < mass < _HEAVIEST:
        return pin.Inertia(_FILL_MASS, np.zeros(3), np.eye(3) * _sphere(_FILL_MASS)), "a sphere"
    along = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end / length).toRotationMatrix()
    limb = pin.Inertia.FromCylinder(mass, radius, length)
    return pin.SE3(along, 0.5 * end).act(limb), "a cylinder along its limb"


def _solid(shape: Element) -> pin.Inertia | None:
    """Returns the inertia of a box, a cylinder or a sphere; None for a mesh and a shape without volume."""
    box, cylinder, sphere = (shape.find(f"geometry/{kind}") for kind in ("box", "cylinder", "sphere"))
    if box is not None:
        x, y, z = numbers(box, "size", 3)
        mass, found = x * y * z, lambda mass: pin.Inertia.FromBox(mass, x, y, z)
    elif cylinder is not None:
        radius, length = (float(numbers(cylinder, name, 1)[0]) for name in ("radius", "length"))
        mass, found = np.pi * radius**2 * length, lambda mass: pin.Inertia.FromCylinder(mass, radius, length)
    elif sphere is not None:
        radius = float(numbers(sphere, "radius", 1)[0])
        mass, found = 4.0 / 3.0 * np.pi * radius**3, lambda mass: pin.Inertia.FromSphere(mass, radius)
    else:
        return None
    if not 0.0 < _DENSITY * mass < _HEAVIEST:
        return None
    return placement(shape).act(found(_DENSITY * mass))


def nearest_physical(inertia: np.ndarray) -> tuple[np.ndarray, float]:
    """Returns (I', violation): the nearest physically possible inertia about the centre of mass, kg·m², and
    by how much the given inertia violates the condition below.

    A body's inertia is I = tr(Σ)·1 − Σ with Σ = ∫ρ r rᵀ ⪰ 0, so Σ = ½ tr(I)·1 − I must be positive
    semidefinite. For the principal moments, this condition is A + B ≥ C; it implies I ⪰ 0 (Wensing, Kim,
    Slotine, IEEE RA-L 2018). Smaller eigenvalues of Σ are raised to a small positive value, and I is computed
    again. The violation is the magnitude of the most negative eigenvalue divided by the trace; it is 0 for a
    physical inertia.
    """
    trace = float(np.trace(inertia))
    eigenvalues, axes = np.linalg.eigh(0.5 * trace * np.eye(3) - inertia)
    scale = max(trace, float(np.abs(eigenvalues).max()), 1e-300)
    floor = _MARGIN * scale
    violation = max(0.0, -float(eigenvalues.min()) / scale)
    if eigenvalues.min() >= floor:
        return inertia, 0.0
    raised = np.maximum(eigenvalues, floor)
    second_moment = (axes * raised) @ axes.T
    return float(raised.sum()) * np.eye(3) - second_moment, violation


def _repair_link(link: Element) -> Iterator[Finding]:
    """Repairs the inertia of one link. Yields the findings and returns the link's mass, kg."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0
    placement(inertial)
    mass_element = inertial.find("mass")
    mass = 0.0 if mass_element is None else float(numbers(mass_element, "value", 1)[0])
    if mass < 0.0:
        raise Refusal(label(link), f"its mass is {mass:.4g} kg; give a positive mass")
    inertia = _read_inertia(inertial)
    if 0.0 < mass < _LEAST_MASS:
        yield Finding("repaired", label(link), f"a mass of {mass:.3g} kg has no effect and was removed")
        link.remove(inertial)
        return 0.0
    if mass == 0.0:
        if inertia is not None and np.abs(inertia).max() > 0.0:
            yield Finding("repaired", label(link), "an inertia without mass is impossible and was removed")
        link.remove(inertial)
        return 0.0
    if inertia is None or float(np.abs(inertia).max()) < 1e-12 * mass:
        _write_inertia(inertial, np.eye(3) * _sphere(mass))
        text = f"no rotational inertia; the inertia of a solid sphere of {mass:.4g} kg was used"
        yield Finding("filled", label(link), text)
        return mass
    physical, violation = nearest_physical(inertia)
    if violation > _MARGIN:
        moments = np.linalg.eigvalsh(inertia)
        listed = ", ".join(f"{moment:.3g}" for moment in moments)
        fault = "a negative moment" if moments[0] <= 0.0 else "A + B < C"
        text = f"impossible principal moments {listed} kg·m² ({fault}); the nearest possible ones were used"
        yield Finding("repaired", label(link), text)
    if physical is not inertia or not all(inertial.find("inertia").get(key) for key in _KEYS):
        _write_inertia(inertial, physical)
    return mass


def _read_inertia(inertial: Element) -> np.ndarray | None:
    element = inertial.find("inertia")
    if element is None:
        return None
    xx, xy, xz, yy, yz, zz = (float(numbers(element, key, 1, (0.0,))[0]) for key in _KEYS)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _sphere(mass: float) -> float:
    radius = (3.0 * mass / (4.0 * np.pi * _DENSITY)) ** (1.0 / 3.0)
    return 0.4 * mass * radius**2


def _write(link: Element, found: pin.Inertia) -> None:
    inertial = etree.SubElement(link, "inertial", {ASSUMED: "true"})
    etree.SubElement(inertial, "origin", xyz=" ".join(repr(float(value)) for value in found.lever))
    etree.SubElement(inertial, "mass", value=repr(float(found.mass)))
    _write_inertia(inertial, found.inertia)


def _write_inertia(inertial: Element, inertia: np.ndarray) -> None:
    for old in inertial.findall("inertia"):
        inertial.remove(old)
    element = etree.SubElement(inertial, "inertia")
    for key, (row, column) in zip(_KEYS, ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), strict=True):
        element.set(key, repr(float(inertia[row, column])))
