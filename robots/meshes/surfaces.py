"""Reads and simplifies the triangles of mesh files. Files outside installed packages are read in a separate
process."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from robots.meshes.files import installed_mesh
from robots.meshes.simplify import simplify
from robots.processes.isolation import Allowance, Fault, inside, isolated

MAX_FACES = 12_000  # faces per mesh; with this number, a laptop's browser rotates several robots smoothly
MAX_BYTES = 100_000_000
READING = 8.0  # s of processor time in which the meshes of a robot are read
_FORMATS = (".stl", ".dae", ".obj", ".ply", ".glb", ".gltf", ".off")
_BRIGHTEST = 238  # pure white would show no shading under the page's lights
Colour = tuple[int, int, int]
Piece = tuple[Colour | None, np.ndarray, np.ndarray]
"""A piece of a mesh: (colour or None, vertices (V, 3) m, faces (F, 3))."""


def mesh_pieces(uris: Iterable[str]) -> dict[str, tuple[Piece, ...]]:
    """Returns the surfaces of the meshes of a canonical URDF by their URI; a mesh that cannot be read is left
    out."""
    found: dict[str, tuple[Piece, ...]] = {}
    others: list[str] = []
    for uri in dict.fromkeys(uris):
        path = installed_mesh(uri)
        if path is None:
            others.append(uri)
            continue
        try:
            found[uri] = _installed_pieces(path)
        except Exception:
            continue  # mesh readers raise many kinds of errors for a bad file
    return {**found, **_isolated_pieces(tuple(others))}


def read_meshes(paths: tuple[str, ...], seconds: float) -> dict[str, tuple[Piece, ...]]:
    """Returns the pieces of all files that can be read within a processor time, s. A process reads no file
    twice."""
    end = time.process_time() + seconds
    for path in paths:
        if path not in _read:
            try:
                _read[path] = read_mesh(Path(path)) if time.process_time() < end else ()
            except Exception:
                _read[path] = ()  # mesh readers raise many kinds of errors for a bad file
    return {path: _read[path] for path in paths if _read[path]}


_read: dict[str, tuple[Piece, ...]] = {}


def read_mesh(path: Path) -> tuple[Piece, ...]:
    """Returns the pieces of a mesh file, one per colour. May raise any exception for a bad file."""
    if path.suffix.lower() not in _FORMATS or path.stat().st_size > MAX_BYTES:
        raise ValueError(f"{path} is not a mesh file, or has more than {MAX_BYTES} bytes")
    scene = trimesh.load_scene(str(path))
    metres = 1.0
    if path.suffix.lower() == ".dae" and scene.units is not None:
        metres = trimesh.units.unit_conversion(scene.units, "meters")  # Gazebo and RViz apply it, too
    pieces: dict[Colour | None, list[tuple[np.ndarray, np.ndarray]]] = {}
    for solid in scene.dump():
        if isinstance(solid, trimesh.Trimesh) and len(solid.faces):
            vertices, faces = metres * np.asarray(solid.vertices), np.asarray(solid.faces)
            if not np.isfinite(vertices).all():
                continue
            if path.suffix.lower() == ".stl":
                vertices, faces = split_creases(vertices, faces)
            pieces.setdefault(_mesh_colour(solid, path), []).append((vertices, faces))
    total = sum(len(faces) for parts in pieces.values() for _, faces in parts)
    share = min(1.0, MAX_FACES / max(total, 1))
    whole = {colour: joined(parts) for colour, parts in pieces.items()}
    return tuple((c, *simplify(v, f, max(200, int(share * len(f))))) for c, (v, f) in whole.items())


def joined(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Joins several surfaces into one (vertices, faces)."""
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate(
        [faces + start for (_, faces), start in zip(parts, offsets, strict=False)]
    )


def split_creases(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns a mesh in which each side of a sharp edge has its own vertices. The faces of a vertex are
    grouped by direction."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
    directions = np.round(1.2 * normals).astype(np.int64)
    keys = np.column_stack([faces.reshape(-1), np.repeat(directions, 3, axis=0)])
    unique, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return vertices[unique[:, 0]], inverse.reshape(-1, 3) if len(first) else faces


def limited(colour: np.ndarray) -> Colour | None:
    """Returns the colour that the page shows for a colour of a mesh, (3,), 0–255."""
    if colour.shape != (3,) or not np.all(np.isfinite(colour)):
        return None
    red, green, blue = (int(c) for c in np.clip(np.round(colour), 0, _BRIGHTEST))
    return red, green, blue


@lru_cache(maxsize=256)
def _installed_pieces(path: Path) -> tuple[Piece, ...]:
    return read_mesh(path)


@lru_cache(maxsize=4)
def _isolated_pieces(paths: tuple[str, ...]) -> dict[str, tuple[Piece, ...]]:
    if not paths:
        return {}
    if inside():
        return read_meshes(paths, READING)
    try:
        return isolated(read_meshes, paths, READING, within=Allowance(2.0 * READING))
    except Fault:
        return {}


def _mesh_colour(solid: trimesh.Trimesh, path: Path) -> Colour | None:
    if path.suffix.lower() == ".stl":
        return None
    material = getattr(solid.visual, "material", None)
    colour = getattr(material if material is not None else solid.visual, "main_color", None)
    return None if colour is None else limited(np.asarray(colour, dtype=float)[:3])
