"""A small capsule around points."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]
_ROUNDS = 16  # steps of the search for the middle of a circle
_DIGITS = 4  # of a coordinate in m
_FEW, _MANY = 60, 250  # directions in which the farthest points are fitted, quickly or tightly
_FACTORS = (1.0, 1.05, 1.1, 1.2, 1.3, 1.5)  # tried for the radius, times the smallest


class Fit(NamedTuple):
    """Ends of the segment, (3,) m, and radius, m."""

    start: Array
    end: Array
    radius: float

    @property
    def volume(self) -> float:
        """m³."""
        return float(_volume(math.dist(self.start, self.end), self.radius))


def reach(points: Array, swell: Array, fit: Fit) -> Array:
    """How far balls stand out of a capsule, (V,) m, below 0 inside. points: their middles (V, 3), m; swell:
    their radii (V,), m."""
    axis = fit.end - fit.start
    length = max(float(axis @ axis), 1e-300)
    along = np.clip((points - fit.start) @ axis / length, 0.0, 1.0)
    return np.linalg.norm(points - fit.start - along[:, None] * axis, axis=1) + swell - fit.radius


def quick_fit(points: Array, swell: Array) -> Fit:
    """Returns about the smallest capsule around balls whose axis is one of their principal axes."""
    few, thick = _farthest(points, swell, _FEW)
    return min((_along(few, thick, axis) for axis in _principal(points).T), key=lambda fit: fit.volume)


def tight_fit(points: Array, swell: Array) -> Fit:
    """Returns a capsule that contains balls, with about the smallest volume and coordinates of 0.1 mm."""
    few, thick = _farthest(points, swell, _MANY)
    rough = [(_along(few, thick, axis), axis) for axis in _principal(points).T]
    rough.sort(key=lambda each: each[0].volume)
    best = min((_refined(few, thick, *each) for each in rough[:2]), key=lambda fit: fit.volume)
    start, end = np.round(best.start, _DIGITS), np.round(best.end, _DIGITS)
    needed = float(reach(points, swell, Fit(start, end, 0.0)).max())
    return Fit(start, end, float(np.ceil((needed + 1e-9) * 10**_DIGITS) / 10**_DIGITS))


def _norm(rows: Array) -> Array:
    return np.sqrt(np.einsum("ij,ij->i", rows, rows))


def _volume(length: Array | float, radius: Array | float) -> Array | float:
    return np.pi * radius**2 * (length + 4.0 / 3.0 * radius)


def _principal(points: Array) -> Array:
    """Orthonormal axes as columns, those of the largest variance first."""
    middle = points - points.mean(axis=0)
    return np.linalg.svd(middle.T @ middle)[0]


def _farthest(points: Array, swell: Array, directions: int) -> tuple[Array, Array]:
    """The balls that reach farthest in directions."""
    chosen = np.unique((points @ sphere(directions).T + swell[:, None]).argmax(axis=0))
    return points[chosen], swell[chosen]


@lru_cache(maxsize=4)
def sphere(count: int) -> Array:
    """Unit vectors (count, 3), evenly spread on a spiral."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


def _along(points: Array, swell: Array, axis: Array) -> Fit:
    """The smallest capsule whose axis has a direction and goes through the middle of the smallest circle."""
    across = np.linalg.svd(axis[None])[2][1:]
    flat = points @ across.T
    middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    best, least = middle, np.inf
    for k in range(_ROUNDS):
        gap = _norm(flat - middle) + swell
        far = int(gap.argmax())
        if gap[far] < least:
            best, least = middle, gap[far]
        middle = middle + (flat[far] - middle) / (k + 2.0)
    return _closed(points, swell, axis, best @ across, _FACTORS)


def _closed(points: Array, swell: Array, axis: Array, through: Array, factors: tuple[float, ...]) -> Fit:
    """The smallest capsule on a line, its radius one of the factors times the smallest one."""
    offset = points - through
    z = offset @ axis
    rho = _norm(offset - z[:, None] * axis)
    radius = float((rho + swell).max()) * np.asarray(factors)[:, None] + 1e-12
    slack = np.sqrt(np.maximum((radius - swell) ** 2 - rho**2, 0.0))
    top, bottom = (z - slack).max(axis=1), (z + slack).min(axis=1)
    middle = 0.5 * (top + bottom)
    top, bottom = np.where(top < bottom, middle, top), np.where(top < bottom, middle, bottom)
    k = int(np.argmin(_volume(top - bottom, radius[:, 0])))
    return Fit(through + bottom[k] * axis, through + top[k] * axis, float(radius[k, 0]))


def _refined(points: Array, swell: Array, fit: Fit, axis: Array) -> Fit:
    """Improves direction, place and radius by Nelder and Mead."""
    across = np.linalg.svd(axis[None])[2][1:]
    size = float(np.ptp(points, axis=0).max()) + fit.radius
    through = 0.5 * (fit.start + fit.end)

    def made(x: Array) -> Fit:
        turned = axis + x[0] * across[0] + x[1] * across[1]
        at = through + size * (x[2] * across[0] + x[3] * across[1])
        return _closed(points, swell, turned / math.hypot(*turned), at, (1.0 + abs(x[4]),))

    simplex = np.vstack([np.zeros(5), np.diag([0.15, 0.15, 0.05, 0.05, 0.1])])
    found = minimize(
        lambda x: made(x).volume / max(fit.volume, 1e-30),
        np.zeros(5),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 200, "xatol": 1e-3, "fatol": 1e-4},
    )
    return made(found.x)
