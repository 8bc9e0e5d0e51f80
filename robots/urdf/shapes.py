"""Removes the shapes and colours of a URDF that cannot be used, so that every reader can read the others."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy

from lxml.etree import _Element as Element

from robots.report import Finding
from robots.urdf.read import Refusal, label, numbers, placement

_SIZES = {"box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}, "sphere": {"radius": 1}, "mesh": {}}
"""The numbers that each kind of shape needs."""


def remove_unusable_shapes(root: Element) -> Iterator[Finding]:
    """Removes shapes and colours without valid numbers; yields a note for each shape. The colours of named
    materials are copied to the shapes."""
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            try:
                _check(shape)
            except Refusal as refusal:
                link.remove(shape)
                yield Finding("note", label(link), f"a {shape.tag} shape is left out: {refusal.finding.text}")
    colours: dict[str | None, Element] = {}
    for material in root.iter("material"):
        for colour in material.findall("color"):
            try:
                numbers(colour, "rgba", 3 if len(colour.get("rgba", "").split()) == 3 else 4)
                colours.setdefault(material.get("name"), colour)
            except Refusal:
                material.remove(colour)
    for material in root.findall("link/visual/material"):
        if material.find("color") is None and material.get("name") in colours:
            material.append(copy(colours[material.get("name")]))
    for material in root.findall("material"):
        root.remove(material)


def _check(shape: Element) -> None:
    """Raises Refusal for a shape without valid numbers."""
    placement(shape)
    geometry = shape.find("geometry")
    solid = None if geometry is None or not len(geometry) else geometry[0]
    if solid is None or solid.tag not in _SIZES:
        raise Refusal("", f"its geometry is not one of {', '.join(_SIZES)}")
    for name, count in _SIZES[solid.tag].items():
        numbers(solid, name, count)
    if solid.tag == "mesh":
        numbers(solid, "scale", 1 if len(solid.get("scale", "").split()) == 1 else 3, (1.0, 1.0, 1.0))
