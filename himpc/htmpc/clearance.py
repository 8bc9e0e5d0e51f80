"""Signed distances between a robot's spheres and what it must not touch, in closed form, with gradients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.compiled import (
    FLAG,
    FLAGS,
    FRAMES,
    INDICES,
    MATRICES,
    MATRIX,
    NUMBER,
    VECTOR,
    compiled,
    inner,
)
from himpc.htmpc.geometry import Placed, geometry, placed
from robots import Robot
from robots.collision import BOX, FLOOR, Obstacle, surroundings

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Clearances:
    """Distances between pairs at knots, nearest pairs only.

    Attributes:
        knot: (r,) index of the configuration.
        distance: (r,) m, negative inside.
        gradient: (r, n) of the distance with respect to q, m/rad.
        sphere, shape: (r,) which pair.
        links: of the spheres. names: of the shapes.
    """

    knot: Indices
    distance: Array
    gradient: Array
    sphere: Indices
    shape: Indices
    links: tuple[str, ...]
    names: tuple[str, ...]

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """(sphere's link, obstacle's name) of each."""
        found = zip(self.sphere.tolist(), self.shape.tolist(), strict=True)
        return [(self.links[sphere], self.names[shape]) for sphere, shape in found]


class CollisionModel:
    """Distances of a robot's spheres to obstacles, and of its arm's spheres to its own base."""

    def __init__(self, robot: Robot, obstacles: tuple[Obstacle, ...], self_collision: bool = False) -> None:
        self._tree = geometry(robot)
        self._around = surroundings(robot, obstacles, self_collision)

    @property
    def links(self) -> tuple[str, ...]:
        """Of the spheres."""
        return self._around.links

    @property
    def empty(self) -> bool:
        """Whether there is nothing to keep clear of."""
        return not self._around.names

    def clearances(self, q: Array, within: float, gradients: bool = True) -> Clearances:
        """All pairs nearer than `within`, m, at configurations q (K, n); without gradients they are empty."""
        return self.between(placed(self._tree, q), within, gradients)

    def between(self, where: Placed, within: float, gradients: bool = True) -> Clearances:
        """The same for joints that are placed already."""
        around, tree = self._around, self._tree
        knot, distance, gradient, sphere, shape = _near(
            *where,
            tree.turns,
            tree.moves,
            around.joint,
            around.centre,
            around.radius,
            around.kind,
            around.carrier,
            around.turn,
            around.middle,
            around.half,
            around.meets,
            within,
            gradients,
        )
        return Clearances(knot, distance, gradient, sphere, shape, around.links, around.names)


@inner
def _from_ball(d: Array, radius: float, u: Array) -> float:
    """Distance of a point d from a ball about the origin; u: the unit vector away from it."""
    away = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    if away > 0.0:
        u[0], u[1], u[2] = d[0] / away, d[1] / away, d[2] / away
    else:
        u[0], u[1], u[2] = 0.0, 0.0, 1.0
    return away - radius


@inner
def _from_box(d: Array, turn: Array, half: Array, u: Array) -> float:
    """The same for a box: from its nearest point; inside, minus the distance to the nearest face."""
    nearest, face, squares = -np.inf, 0, 0.0
    for a in range(3):
        here = turn[0, a] * d[0] + turn[1, a] * d[1] + turn[2, a] * d[2]
        out = abs(here) - half[a]
        if out > nearest:
            nearest, face = out, a
        squares += max(out, 0.0) ** 2
    length = np.sqrt(squares)
    u[0] = u[1] = u[2] = 0.0
    for a in range(3):
        here = turn[0, a] * d[0] + turn[1, a] * d[1] + turn[2, a] * d[2]
        share = max(abs(here) - half[a], 0.0) / length if length > 0.0 else 0.0
        if length == 0.0 and a == face:
            share = 1.0
        for b in range(3):
            u[b] += turn[b, a] * (share if here >= 0.0 else -share)
    return length if length > 0.0 else nearest


@compiled(
    *(FRAMES, MATRICES, MATRICES, INDICES, MATRIX),
    *(INDICES, MATRIX, VECTOR),
    *(INDICES, INDICES, MATRICES, MATRIX, MATRIX, FLAGS),
    *(NUMBER, FLAG),
)
def _near(
    R: Array,
    p: Array,
    z: Array,
    turns: Indices,
    moves: Array,
    joint: Indices,
    centre: Array,
    radius: Array,
    kind: Indices,
    carrier: Indices,
    turn: Array,
    middle: Array,
    half: Array,
    meets: NDArray[np.bool_],
    within: float,
    gradients: bool,
) -> tuple[Indices, Array, Array, Indices, Indices]:
    """A sphere's distance is that of its centre less its radius. Its gradient is the unit vector from the
    shape to the centre, on the motion of the one against the other."""
    K, n, S, B = len(p), moves.shape[1], len(radius), len(kind)
    C = np.empty((K, S, 3))
    for k in range(K):
        for s in range(S):
            for a in range(3):
                C[k, s, a] = p[k, joint[s], a]
                for b in range(3):
                    C[k, s, a] += R[k, joint[s], a, b] * centre[s, b]
    most = K * S * B
    knot, sphere, shape = np.empty(most, np.intp), np.empty(most, np.intp), np.empty(most, np.intp)
    distance, normal = np.empty(most), np.empty((most, 3))
    d, u, w = np.empty(3), np.empty(3), np.empty(3)
    count = 0
    for o in range(B):
        c = carrier[o]
        for k in range(K):
            for s in range(S):
                if not meets[o, s]:
                    continue
                # From the shape's middle to the sphere's, in the axes of the shape's carrier.
                for a in range(3):
                    w[a] = C[k, s, a] - p[k, c, a]
                for a in range(3):
                    d[a] = R[k, c, 0, a] * w[0] + R[k, c, 1, a] * w[1] + R[k, c, 2, a] * w[2] - middle[o, a]
                if kind[o] == FLOOR:
                    found = d[2]
                    u[0], u[1], u[2] = 0.0, 0.0, 1.0
                elif kind[o] == BOX:
                    found = _from_box(d, turn[o], half[o], u)
                else:
                    found = _from_ball(d, half[o, 0], u)
                found -= radius[s]
                # Neither is what is not a number near.
                if not found <= within:
                    continue
                for a in range(3):
                    normal[count, a] = R[k, c, a, 0] * u[0] + R[k, c, a, 1] * u[1] + R[k, c, a, 2] * u[2]
                knot[count], sphere[count], shape[count], distance[count] = k, s, o, found
                count += 1
    slopes = np.zeros((count if gradients else 0, n))
    for r in range(len(slopes)):
        k, s, c = knot[r], sphere[r], carrier[shape[r]]
        x, y, h = normal[r]
        for j in range(1, n + 1):
            # What moves both moves neither against the other.
            sign = moves[joint[s], j - 1] - moves[c, j - 1]
            if sign == 0.0:
                continue
            for a in range(3):
                w[a] = z[k, j, a]
                d[a] = C[k, s, a] - p[k, j, a]
            if turns[j]:
                along = (
                    x * (w[1] * d[2] - w[2] * d[1])
                    + y * (w[2] * d[0] - w[0] * d[2])
                    + h * (w[0] * d[1] - w[1] * d[0])
                )
            else:
                along = x * w[0] + y * w[1] + h * w[2]
            slopes[r, j - 1] = sign * along
    return knot[:count], distance[:count], slopes, sphere[:count], shape[:count]
