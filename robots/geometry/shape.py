"""What is drawn of a robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
