"""Writes the collision geometry and the cover of the robots of the catalog, from their meshes: python -m
robots.loading.write

The program takes about a minute and needs the extra `meshes`. With the stored geometry, contacts and
distances are the same with and without this extra, and a robot loads in milliseconds."""

from __future__ import annotations

from robots.catalog import CATALOG, CatalogEntry
from robots.covering.covers import made_cover
from robots.geometry import CollisionModel, as_json
from robots.loading.load import load_robot
from robots.mechanics.exclusions import collision_model
from robots.shapes.collision_shapes import collision_solids


def made(entry: CatalogEntry) -> CollisionModel:
    """Makes the collision geometry of a robot of the catalog."""
    robot = load_robot(entry.name)
    return collision_model(robot, collision_solids(robot), entry.hollow)


if __name__ == "__main__":
    for each in CATALOG.values():
        each.collision_path.write_text(as_json(made(each)))
        each.cover_path.write_text(as_json(made_cover(load_robot(each.name), tries=2)))
