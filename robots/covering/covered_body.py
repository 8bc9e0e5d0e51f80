"""A body of a robot as triangles, and the distance by which capsules stand out of the body."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robots.covering.capsule_fit import Fit, quick_fits, reach
from robots.covering.covered import Patch

if TYPE_CHECKING:
    from scipy.spatial import KDTree

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
_FINE = 15  # edges are cut if they are longer than the largest extent of a body divided by this
_LARGEST = 40_000  # number of triangles of a body, beyond which no triangles are cut
_SAMPLE = 500  # number of triangles of a body with which groups are found
_NEAR = 8_000  # number of points of a body from which distances are measured
_SURFACE = 80  # number of points of a capsule whose distances are measured


@dataclass(frozen=True, eq=False)
class Body:
    """The triangles of a body.

    Attributes:
        joint: Pinocchio index of the body's joint. names: names of the body's links.
        corners: (F, 3, 3) m, corners of the triangles. swells: (F,) m, see `Patch.swell`.
        links: (F,), index of each triangle's link.
    """

    joint: int
    names: tuple[str, ...]
    corners: Array
    swells: Array
    links: Indices

    @cached_property
    def areas(self) -> Array:
        """Areas of the triangles, (F,) m², above 0."""
        a, b, c = self.corners.swapaxes(0, 1)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1) + 1e-12

    @cached_property
    def sample(self) -> Indices:
        """The sample: indices of the triangles with which groups are found, evenly spread over the area."""
        return self._drawn(_SAMPLE)

    @cached_property
    def middles(self) -> Array:
        """Middles of the sample's triangles, (S, 3) m."""
        return self.corners[self.sample].mean(axis=1)

    @cached_property
    def swell(self) -> Array:
        """Radii of the balls that represent the sample's triangles, (S,) m; `middles` are their centres."""
        corners = self.corners[self.sample] - self.middles[:, None, :]
        return self.swells[self.sample] + 0.5 * np.sqrt((corners**2).sum(axis=2)).max(axis=1)

    @cached_property
    def _nearby(self) -> KDTree:
        from scipy.spatial import KDTree  # its import takes long, and only new covers need it

        return KDTree(self.corners[self._drawn(_NEAR)].mean(axis=1))

    def fits(self, group: Indices) -> Fit:
        """Returns capsules around the groups of the sample, (K,)."""
        return quick_fits(self.middles, self.swell, group == np.arange(group.max() + 1)[:, None])

    def excess(self, fits: Fit) -> float:
        """Returns the distance by which capsules stand out of the body, m. It is the root mean square over
        the outer surface of the capsules."""
        gaps, areas = self.gaps(fits, _SURFACE)
        return float(np.sqrt(np.average(gaps**2, weights=areas)))

    def gaps(self, fits: Fit, count: int) -> tuple[Array, Array]:
        """Returns two arrays for points on the outer surface of the capsules: the distance of each point from
        the triangles, m, and the area that it represents, m²."""
        points, own = surfaces(fits, count), np.repeat(np.arange(len(fits.radius)), count)
        out = reach(points, np.zeros(len(points)), fits)
        out[own, np.arange(len(points))] = 1.0
        outer = out.min(axis=0) > 0.0
        areas, points = np.repeat(fits.area / count, count)[outer], points[outer]
        return np.maximum(self._nearby.query(points)[0] - self.swells.max(), 0.0), areas

    def name(self, mask: NDArray[np.bool_]) -> str:
        """Returns the name of the link that has the largest area among some triangles."""
        return self.names[int(np.bincount(self.links[mask], weights=self.areas[mask]).argmax())]

    def _drawn(self, most: int) -> Indices:
        share = self.areas / self.areas.sum() + 0.1 / len(self.areas)
        count = min(len(share), most)
        drawn = np.random.default_rng(0).choice(len(share), count, replace=False, p=share / share.sum())
        return np.sort(drawn)


def body_of(surfaces: list[Patch]) -> Body:
    """Returns the body that the patches of one joint form. Large triangles are cut into small ones."""
    names = tuple(dict.fromkeys(patch.link for patch in surfaces))
    corners = np.concatenate([patch.corners for patch in surfaces])
    swells = np.concatenate([np.full(len(patch.corners), patch.swell) for patch in surfaces])
    links = np.concatenate([np.full(len(patch.corners), names.index(patch.link)) for patch in surfaces])
    edge = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / _FINE
    return Body(surfaces[0].joint, names, *_cut(corners, swells, links, edge))


def _cut(corners: Array, swells: Array, links: Indices, edge: float) -> tuple[Array, Array, Indices]:
    """Halves the longest edge of each triangle repeatedly, until all edges are short or there are enough
    triangles."""
    done: list[tuple[Array, Array, Indices]] = []
    count = 0
    while len(swells):
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = lengths.max(axis=1) > edge
        done.append((corners[~long], swells[~long], links[~long]))
        count += len(done[-1][1])
        corners, swells, links = corners[long], swells[long], links[long]
        if count + 2 * len(swells) > _LARGEST:
            done.append((corners, swells, links))
            break
        first, rows = lengths[long].argmax(axis=1), np.arange(len(swells))
        a, b, c = (corners[rows, (first + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        swells, links = np.tile(swells, 2), np.tile(links, 2)
    first, second, third = zip(*done, strict=True)
    return np.concatenate(first), np.concatenate(second), np.concatenate(third)


def surfaces(fits: Fit, count: int) -> Array:
    """Returns points that are evenly spread on the surfaces of capsules (K,), `count` points of each,
    (K count, 3) m."""
    axis, radius, length = fits.end - fits.start, fits.radius[:, None], fits.length[:, None]
    across = np.linalg.svd(axis[:, None, :])[2][:, 1:]
    along = np.where(length > 0.0, axis / np.maximum(length, 1e-300), np.cross(across[:, 0], across[:, 1]))
    # The area of a ball or a cylinder between two heights is proportional to their difference.
    height = (length + 2.0 * radius) * (np.arange(count) + 0.5) / count - radius
    ring = np.sqrt(np.maximum(radius**2 - (height - np.clip(height, 0.0, length)) ** 2, 0.0))
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    local = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=2)
    found = fits.start[:, None, :] + local @ np.concatenate([across, along[:, None, :]], axis=1)
    return found.reshape(-1, 3)
