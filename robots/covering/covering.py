"""Covers the surfaces of a robot with few capsules. The triangles of each body are divided into groups, and
each group gets a capsule. The best groups are those whose capsules stand out least from the body."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robots.arrays import Array, Indices, Mask
from robots.covering.capsule_fit import Fit, quick_fits, reach, tight_fit
from robots.covering.covered import Patch
from robots.geometry import Capsule, point

if TYPE_CHECKING:
    from scipy.spatial import KDTree


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

    def name(self, mask: Mask) -> str:
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


PER_BODY = 2.6
"""Largest mean number of capsules per body of a robot."""
MOST = 6
"""Largest number of capsules of a link, and of a body whose links are treated as one."""
_LINKS = 4  # if a body has more links than this, all its links are treated as one
_CUTS = (0.25, 0.4, 0.6, 0.75)  # positions of a cut, as shares of the extent along a principal axis
_SMALL = 0.03  # share of a usual body's size; a body whose capsules stand out less gets no further capsules
_WORK = 1_300_000  # largest sum of triangles over all improvements; a core needs about 10 s for it
_FIXED_WORK = 20_000  # number of triangles that is added for each improvement
_WORTH = 0.97  # largest ratio of the distances after and before an improvement


class Cut(NamedTuple):
    """Points of a group with axis · x ≥ offset (m) become a new group."""

    group: int
    axis: Array
    offset: float


class Groups(NamedTuple):
    """Cuts that form groups, and the distance, m, by which capsules around these groups of the sample stand
    out."""

    cuts: tuple[Cut, ...]
    excess: float


class Found(NamedTuple):
    """Cuts, the capsules around their groups, and the distance, m, by which the capsules stand out."""

    cuts: tuple[Cut, ...]
    capsules: list[Capsule]
    excess: float

    @property
    def groups(self) -> int:
        return len(self.cuts) + 1


def grouped(points: Array, cuts: tuple[Cut, ...]) -> Indices:
    """Returns the index of each point's group."""
    group = np.zeros(len(points), np.intp)
    for k, cut in enumerate(cuts):
        group[(group == cut.group) & (points @ cut.axis >= cut.offset)] = k + 1
    return group


def covering(surfaces: Iterable[Patch], weights: Mapping[int, float]) -> tuple[Capsule, ...]:
    """Returns capsules that contain surfaces. Each triangle is completely inside one capsule of its body.

    weights: for each joint, the weight of the distance by which the capsules of its body stand out.
    """
    ordered = sorted(surfaces, key=lambda patch: (patch.joint == 0, patch.joint))
    bodies = [body for _, own in groupby(ordered, lambda patch: patch.joint) for body in _parts(list(own))]
    found = [_made(body, ()) for body in bodies]
    size = float(np.median([_extent(each.capsules[0]) for each in found])) if found else 0.0
    left = int(PER_BODY * len({body.joint for body in bodies})) - len(bodies)
    ended: set[int] = set()
    work = 0
    while left > 0 and work < _WORK:
        worst = [
            (each.excess * weights[body.joint], k)
            for k, (body, each) in enumerate(zip(bodies, found, strict=True))
            if k not in ended and each.groups < MOST and each.excess > _SMALL * size
        ]
        if not worst:
            break
        k = max(worst)[1]
        work += len(bodies[k].swells) + _FIXED_WORK
        better = _with_more(bodies[k], found[k], min(3, left, MOST - found[k].groups))
        if better is None:
            ended.add(k)
        else:
            left -= len(better.capsules) - len(found[k].capsules)
            found[k] = better
    every = [capsule for each in found for capsule in each.capsules]
    return tuple(each for each in every if not any(_inside(each, other) for other in every))


def _parts(surfaces: list[Patch]) -> list[Body]:
    """Returns one part per link of a body, or a single part if the body has many links."""
    names = dict.fromkeys(patch.link for patch in surfaces)
    if len(names) > _LINKS:
        return [body_of(surfaces)]
    return [body_of([patch for patch in surfaces if patch.link == name]) for name in names]


def _inside(small: Capsule, large: Capsule) -> bool:
    """Returns whether the first capsule is contained in the second one, which is larger and on the same
    body."""
    if small.joint != large.joint or small.radius >= large.radius:
        return False
    ends = np.array([small.start, small.end])
    whole = Fit(np.array(large.start), np.array(large.end), np.array(large.radius))
    return bool((reach(ends, np.full(2, small.radius), whole) <= 0.0).all())


def _extent(capsule: Capsule) -> float:
    return math.dist(capsule.start, capsule.end) + 2.0 * capsule.radius


def _with_more(body: Body, before: Found, most: int) -> Found | None:
    """Returns capsules for up to `most` additional groups, if these capsules stand out less; otherwise None.
    Divisions with the largest reduction per group, measured with the sample, are tried first."""
    start = body.excess(body.fits(grouped(body.middles, before.cuts)))
    tried = [_divided(body, before, more) for more in range(1, most + 1)]
    ways = [each for each in tried if each is not None]
    ways.sort(key=lambda each: (each.excess - start) / (len(each.cuts) + 1 - before.groups))
    made = (_made(body, each.cuts) for each in ways)
    return next((each for each in made if each.excess < _WORTH * before.excess), None)


def _divided(body: Body, before: Found, more: int) -> Groups | None:
    """Returns the best of several divisions that add a number of groups; None if there is no such
    division."""
    count = before.groups + more
    ways = [*_refinements(body, before, more), *_slabs(body.middles, count, 0, 0)]
    masks = np.array([grouped(body.middles, way) for way in ways])[:, None, :] == np.arange(count)[:, None]
    whole = masks.any(axis=2).all(axis=1)
    if not whole.any():
        return None
    ways, masks = [way for way, each in zip(ways, whole, strict=True) if each], masks[whole]
    fits = quick_fits(body.middles, body.swell, masks.reshape(-1, len(body.middles)))
    every = Fit(*(each.reshape(len(ways), count, *each.shape[1:]) for each in fits))
    excess = [body.excess(every.chosen(k)) for k in range(len(ways))]
    k = int(np.argmin(excess))
    return Groups(ways[k], excess[k])


def _refinements(body: Body, groups: Found, more: int) -> Iterator[tuple[Cut, ...]]:
    """Yields divisions that cut one of the groups into slabs. If there are two slabs, they may be unequal."""
    labels = grouped(body.middles, groups.cuts)
    for k in range(groups.groups):
        points = body.middles[labels == k]
        for way in _slabs(points, more + 1, k, groups.groups - 1):
            yield (*groups.cuts, *way)
        for axis in _axes(points) if more == 1 else ():
            z = points @ axis
            for share in _CUTS:
                yield (*groups.cuts, Cut(k, axis, float(z.min() + share * np.ptp(z))))


def _slabs(points: Array, count: int, group: int, last: int) -> Iterator[tuple[Cut, ...]]:
    """Yields the cuts of a group into slabs, by planes at equal distances across an axis, or into two rows of
    slabs.

    last: the largest index of a group before the cuts.
    """

    def slices(z: Array, axis: Array, parts: int) -> tuple[Cut, ...]:
        heights = float(z.min()) + np.arange(1, parts) / parts * float(np.ptp(z))
        return tuple(Cut(last + k if k else group, axis, float(height)) for k, height in enumerate(heights))

    axes = _axes(points)
    for axis in axes:
        yield slices(points @ axis, axis, count)
        for second in axes if count >= 4 and count % 2 == 0 else ():
            if abs(second @ axis) > 0.5:
                continue
            z = points @ second
            middle = 0.5 * float(z.min() + z.max())
            row = (group, *range(last + 1, last + count // 2))
            yield (
                *slices(points @ axis, axis, count // 2),
                *(Cut(each, second, middle) for each in row),
            )


def _axes(points: Array) -> list[Array]:
    """Returns the axes of the joint, and the principal axes that differ from these axes by more than 10°."""
    offset = points - points.mean(axis=0)
    principal = np.linalg.eigh(offset.T @ offset)[1].T
    return [*np.eye(3), *(axis for axis in principal if np.abs(axis).max() < np.cos(np.radians(10.0)))]


def _made(body: Body, cuts: tuple[Cut, ...]) -> Found:
    """Returns capsules that contain all triangles of a body."""
    group = grouped(body.corners.mean(axis=1), cuts)
    parts = [group == k for k in np.unique(group)]
    tight = [tight_fit(body.corners[part].reshape(-1, 3), np.repeat(body.swells[part], 3)) for part in parts]
    capsules = [
        Capsule(body.joint, body.name(part), point(fit.start), point(fit.end), float(fit.radius))
        for part, fit in zip(parts, tight, strict=True)
    ]
    fits = Fit(*(np.array(each) for each in zip(*tight, strict=True)))
    return Found(cuts, capsules, body.excess(fits))
