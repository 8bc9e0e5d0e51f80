"""The files with the geometry of the robots of the catalog."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from robots.geometry.collision_model import CollisionModel
from robots.geometry.cover import Cover

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
