"""Covers the surfaces of a robot with few capsules. The triangles of each body are divided into groups, and
each group gets a capsule."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.covering.capsule_fit import Fit, quick_fits, reach, tight_fit
from robots.covering.covered import Patch
from robots.covering.covered_body import Body, body_of
from robots.geometry.cover import Capsule

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
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
        Capsule(body.joint, body.name(part), _point(fit.start), _point(fit.end), float(fit.radius))
        for part, fit in zip(parts, tight, strict=True)
    ]
    fits = Fit(*(np.array(each) for each in zip(*tight, strict=True)))
    return Found(cuts, capsules, body.excess(fits))


def _point(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
