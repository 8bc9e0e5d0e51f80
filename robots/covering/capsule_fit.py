"""Computes small capsules around points, for many groups of points at once."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from robots.arrays import Array, Indices, Mask
from robots.geometry import directions

_ROUNDS = 12  # number of steps of the search for the middle of a circle
_DIGITS = 4  # decimal places of a coordinate in m
_FEW, _MANY = 48, 100  # numbers of directions in which a quick and a tight fit look for farthest points
_FACTORS = np.array([1.0, 1.05, 1.1, 1.2, 1.3, 1.5])  # radii that are tried, as multiples of the smallest
_BLOCK = 1_000  # number of balls whose heights fit into a fast memory
_AT_ONCE = 2_000_000  # largest number of elements of an array


class Fit(NamedTuple):
    """Capsules: ends of the segments, (…, 3) m, and radii, (…,) m."""

    start: Array
    end: Array
    radius: Array

    def chosen(self, index: object) -> Fit:
        return Fit(*(each[index] for each in self))  # pyright: ignore[reportCallIssue, reportArgumentType]

    @property
    def length(self) -> Array:
        """Lengths of the segments, (…,) m."""
        return np.sqrt(((self.end - self.start) ** 2).sum(axis=-1))

    @property
    def volume(self) -> Array:
        """Volumes, (…,) m³."""
        return _volume(self.length, self.radius)

    @property
    def area(self) -> Array:
        """Surface areas, (…,) m²."""
        return 2.0 * np.pi * self.radius * (self.length + 2.0 * self.radius)


def reach(points: Array, swell: Array, fit: Fit) -> Array:
    """Returns the distance by which balls stand out of capsules, (…, V) m; negative inside. points: centres
    of the balls, (V, 3) m; swell: radii of the balls, (V,) m."""
    axis = (fit.end - fit.start)[..., None, :]
    offset = points - fit.start[..., None, :]
    length = np.maximum((axis**2).sum(axis=-1), 1e-300)
    along = np.clip((offset * axis).sum(axis=-1) / length, 0.0, 1.0)
    gap = offset - along[..., None] * axis
    return np.sqrt((gap**2).sum(axis=-1)) + swell - fit.radius[..., None]


def quick_fits(points: Array, swell: Array, groups: Mask) -> Fit:
    """Returns a capsule around each group of balls, which is a row of (B, V). It is about the smallest
    capsule whose axis is a principal axis of the group. Groups must not be empty."""
    rows = max(1, _AT_ONCE // (_FEW * len(points)))
    parts = [_quick(points, swell, groups[k : k + rows]) for k in range(0, len(groups), rows)]
    return Fit(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def tight_fit(points: Array, swell: Array) -> Fit:
    """Returns a capsule that contains balls and has about the smallest volume. Its numbers are multiples of
    0.1 mm."""
    chosen = _farthest(points, swell)
    few, thick = points[chosen], swell[chosen]
    ends = np.unique(few, axis=0)
    if len(ends) <= 2 and np.ptp(swell) == 0.0:
        return _rounded(points, swell, ends[0], ends[-1])
    middle, axes = _principal(points, np.ones((1, len(points)), np.bool_))
    rough = _on_axes(few[None], thick[None], middle, axes).chosen(0)
    k = int(rough.volume.argmin())
    best = _refined(few, thick, rough.chosen(k), axes[0, :, k])
    return _rounded(points, swell, best.start, best.end)


def _rounded(points: Array, swell: Array, start: Array, end: Array) -> Fit:
    """Returns a capsule that contains balls. The coordinates of its ends are rounded, and its radius is
    rounded up."""
    start, end = np.round(start, _DIGITS) + 0.0, np.round(end, _DIGITS) + 0.0
    needed = float(reach(points, swell, Fit(start, end, np.zeros(()))).max())
    return Fit(start, end, np.ceil((needed + 1e-9) * 10**_DIGITS) / 10**_DIGITS)


def _farthest(points: Array, swell: Array) -> Indices:
    """Returns the indices of the balls that are farthest out in one of the directions."""
    most, found = np.full(_MANY, -np.inf), np.zeros(_MANY, np.intp)
    for first in range(0, len(points), _BLOCK):
        heights = directions(_MANY) @ points[first : first + _BLOCK].T + swell[first : first + _BLOCK]
        place = heights.argmax(axis=1)
        height = heights[np.arange(_MANY), place]
        found = np.where(height > most, place + first, found)
        most = np.maximum(height, most)
    return np.unique(found)


def _volume(length: Array, radius: Array) -> Array:
    return np.pi * radius**2 * (length + 4.0 / 3.0 * radius)


def _quick(points: Array, swell: Array, groups: Mask) -> Fit:
    heights = directions(_FEW) @ points.T + swell
    far = np.where(groups[:, None, :], heights, -np.inf).argmax(axis=2)
    fits = _on_axes(points[far], swell[far], *_principal(points, groups))
    return fits.chosen((np.arange(len(groups)), fits.volume.argmin(axis=1)))


def _principal(points: Array, groups: Mask) -> tuple[Array, Array]:
    """Returns the middles of groups, (B, 3) m, and their principal axes as columns, (B, 3, 3)."""
    share = groups / groups.sum(axis=1, keepdims=True)
    origin = points.mean(axis=0)
    offset = points - origin
    middle = share @ offset
    squares = (share @ (offset[:, :, None] * offset[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    return middle + origin, np.linalg.eigh(squares - middle[:, :, None] * middle[:, None, :])[1]


def _on_axes(points: Array, swell: Array, middle: Array, axes: Array) -> Fit:
    """Returns small capsules (B, 3) around points (B, D, 3). Their axes have the directions (B, 3, 3). Each
    axis goes through the middle of the smallest circle around the points, seen along the axis."""
    local = (points - middle[:, None, :]) @ axes
    z = local.swapaxes(1, 2)
    flat = np.stack([local[:, :, [1, 2]], local[:, :, [2, 0]], local[:, :, [0, 1]]], axis=1)
    thick = swell[:, None, :]
    at = 0.5 * (flat.min(axis=2) + flat.max(axis=2))
    best, least = at, np.full(at.shape[:2], np.inf)
    for k in range(_ROUNDS):
        gap = np.sqrt(((flat - at[:, :, None, :]) ** 2).sum(axis=3)) + thick
        far = gap.argmax(axis=2)[:, :, None]
        width = np.take_along_axis(gap, far, axis=2)[:, :, 0]
        best = np.where((width < least)[:, :, None], at, best)
        least = np.minimum(width, least)
        at = at + (np.take_along_axis(flat, far[..., None], axis=2)[:, :, 0] - at) / (k + 2.0)
    rho = np.sqrt(((flat - best[:, :, None, :]) ** 2).sum(axis=3))
    bottom, top, radius = _closed(z, rho, thick, _FACTORS)
    through = np.zeros((*best.shape[:2], 3))
    for k in range(3):
        through[:, k, [(k + 1) % 3, (k + 2) % 3]] = best[:, k]
    ends = [
        (through + height[..., None] * np.eye(3)) @ axes.swapaxes(1, 2) + middle[:, None, :]
        for height in (bottom, top)
    ]
    return Fit(ends[0], ends[1], radius)


def _closed(z: Array, rho: Array, swell: Array, factors: Array) -> tuple[Array, Array, Array]:
    """Returns (bottom, top, radius) of the smallest capsules on lines. Their radii are the smallest radius
    times one of the factors.

    z, rho: (…, D) m, positions of points along the lines, and distances of the points from the lines.
    """
    radius = (rho + swell).max(axis=-1)[..., None] * factors + 1e-12
    slack = (radius[..., None] - swell[..., None, :]) ** 2 - rho[..., None, :] ** 2
    slack = np.sqrt(np.maximum(slack, 0.0))
    top, bottom = (z[..., None, :] - slack).max(axis=-1), (z[..., None, :] + slack).min(axis=-1)
    ball = top < bottom
    middle = 0.5 * (top + bottom)
    top, bottom = np.where(ball, middle, top), np.where(ball, middle, bottom)
    k = _volume(top - bottom, radius).argmin(axis=-1)[..., None]
    return tuple(np.take_along_axis(each, k, axis=-1)[..., 0] for each in (bottom, top, radius))  # pyright: ignore[reportReturnType]


def _refined(points: Array, swell: Array, fit: Fit, axis: Array) -> Fit:
    """Returns a capsule with improved direction, position and radius, found by the method of Nelder and
    Mead."""
    across = np.linalg.svd(axis[None])[2][1:]
    size = float(np.ptp(points, axis=0).max()) + float(fit.radius)
    through = 0.5 * (fit.start + fit.end)

    thick = swell.any()

    def made(x: Array) -> tuple[float, Array, Array, float, float, float]:
        turned = axis + x[0] * across[0] + x[1] * across[1]
        turned = turned / math.hypot(*turned)
        at = through + size * (x[2] * across[0] + x[3] * across[1])
        offset = points - at
        z = offset @ turned
        apart = np.maximum(np.einsum("ij,ij->i", offset, offset) - z * z, 0.0)
        widest = (np.sqrt(apart) + swell).max() if thick else math.sqrt(apart.max())
        radius = float(widest) * (1.0 + abs(float(x[4]))) + 1e-12
        slack = np.sqrt(np.maximum((radius - swell) ** 2 - apart, 0.0))
        top, bottom = float((z - slack).max()), float((z + slack).min())
        if top < bottom:
            top = bottom = 0.5 * (top + bottom)
        return math.pi * radius**2 * (top - bottom + 4.0 / 3.0 * radius), at, turned, bottom, top, radius

    from scipy.optimize import minimize  # its import takes long, and only this fit needs it

    least = max(float(fit.volume), 1e-30)
    simplex = np.vstack([np.zeros(5), np.diag([0.15, 0.15, 0.05, 0.05, 0.1])])
    found = minimize(
        lambda x: made(x)[0] / least,
        np.zeros(5),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": 150, "xatol": 1e-3, "fatol": 1e-4},
    )
    _, at, turned, bottom, top, radius = made(found.x)
    return Fit(at + bottom * turned, at + top * turned, np.array(radius))
