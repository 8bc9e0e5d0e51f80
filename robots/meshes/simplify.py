"""Reduces the number of triangles for the browser, by clustering vertices on a grid."""

from __future__ import annotations

import numpy as np


def simplify(vertices: np.ndarray, faces: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns (vertices, faces) with at most about `most` faces. A mesh that already has few enough faces is
    returned unchanged.

    All vertices in one cell of a grid move to their mean position. Vertices whose normals point to different
    sides stay separate, so edges stay sharp, but have the same position, so no gap opens. The size of the
    cells is increased until the mesh has few enough faces.
    """
    if len(faces) <= most:
        return vertices, faces
    normals = np.round(1.2 * _vertex_normals(vertices, faces)).astype(np.int64)
    extent = float(np.ptp(vertices, axis=0).max())
    if extent <= 0.0:
        return vertices, faces[:most]
    corners = vertices[faces]
    area = (
        0.5
        * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    )
    # With about two triangles per cell, this cell size would result in `most` faces. The search begins with
    # half of it.
    cell = max(0.5 * float(np.sqrt(2.0 * area / most)), 1e-6 * extent)
    result = vertices, faces
    while len(result[1]) > most and cell < extent:
        result = _cluster(vertices, faces, normals, cell)
        cell *= 1.25
    return result


def _cluster(
    vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray]:
    grid = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64)
    spot = _labels(grid)
    counts = np.bincount(spot)
    means = np.column_stack([np.bincount(spot, weights=vertices[:, k]) / counts for k in range(3)])
    label = _labels(np.column_stack([spot[:, None], normals]))
    spot_of = np.zeros(label.max() + 1, dtype=np.int64)
    spot_of[label] = spot
    corners = spot[faces]
    distinct = (
        (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    )
    kept = label[faces][distinct]
    used, compact = np.unique(kept, return_inverse=True)
    return means[spot_of[used]], compact.reshape(-1, 3)


def _labels(rows: np.ndarray) -> np.ndarray:
    """Returns one number per row of integers. Equal rows have equal numbers."""
    shifted = rows - rows.min(axis=0)
    spans = shifted.max(axis=0) + 1
    codes = np.zeros(len(rows), dtype=np.int64)
    for column, span in zip(shifted.T, spans, strict=True):
        codes = codes * span + column
    return np.unique(codes, return_inverse=True)[1].reshape(-1)


def _vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    corners = vertices[faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.column_stack(
        [
            np.bincount(faces.reshape(-1), weights=np.repeat(weighted[:, k], 3), minlength=len(vertices))
            for k in range(3)
        ]
    )
    return normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30)
