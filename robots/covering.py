"""Covers the surfaces of a robot with few capsules: the triangles of each body are grouped, and each group
gets a capsule."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from robots.capsule_fit import Fit, quick_fit, reach, tight_fit
from robots.cover import Capsule
from robots.covered import Patch

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]
PER_BODY = 2.4
"""Capsules of a robot, divided by the number of its bodies, at most."""
MOST = 4
"""Capsules of a body, at most; each link beyond the first that is fixed to it allows one more, up to 10."""
_FINE = 12  # parts into which the edges of large triangles are cut, per largest extent of a body
_LARGEST = 60_000  # triangles of a body, beyond which no more are cut
_SAMPLE = 800  # triangles of a body by which groups are found
_CUTS = (0.25, 0.4, 0.5, 0.6, 0.75)  # of the extent along a principal axis
_TRIED = 3  # cuts from which groups are improved
_ROUNDS = 6
MOST_LINKS = 6
_SMALL = 0.004  # of the largest body: one whose cover stands out less gets no more capsules
_TAPER = 0.5  # how much less the base counts than the last link


class Piece(NamedTuple):
    """Triangles (F, 3, 3), m, their balls' radii (F,), m, and the index of the link of each."""

    corners: Array
    swell: Array
    link: Indices

    def part(self, mask: Mask | Indices) -> Piece:
        return Piece(self.corners[mask], self.swell[mask], self.link[mask])


@dataclass(frozen=True, eq=False)
class Body:
    """The triangles of a body, and a sample of them, by which groups are found."""

    joint: int
    names: tuple[str, ...]
    piece: Piece
    weight: float

    @property
    def most(self) -> int:
        """Largest number of capsules."""
        return min(MOST + len(self.names) - 1, 10)

    @cached_property
    def sample(self) -> Piece:
        share = _areas(self.piece) + 1e-12
        share = share / share.sum() + 0.1 / len(share)
        chosen = np.random.default_rng(0).choice(
            len(share), min(len(share), _SAMPLE), replace=False, p=share / share.sum()
        )
        return self.piece.part(np.sort(chosen))

    @cached_property
    def middles(self) -> Array:
        """(F, 3), m, of the sample's triangles."""
        return self.sample.corners.mean(axis=1)

    @cached_property
    def nearby(self) -> cKDTree:
        """Points of all the triangles."""
        return cKDTree(np.concatenate([self.piece.corners.reshape(-1, 3), self.piece.corners.mean(axis=1)]))

    def fits(self, group: Indices) -> list[Fit]:
        """A capsule around the sample of each group."""
        return [
            quick_fit(self.middles[own], self.sample.swell[own])
            for own in (group == k for k in range(group.max() + 1))
        ]

    def excess(self, fits: list[Fit]) -> float:
        """How far capsules stand out, m: mean of the squares over their outer surface, rooted."""
        gaps = np.concatenate([self.gaps(fits, k) for k in range(len(fits))])
        return float(np.sqrt(np.mean(gaps**2)))

    def gaps(self, fits: list[Fit], k: int, count: int = 160) -> Array:
        """Distances, m, from points of a capsule's surface that lie in no other one to the triangles."""
        surface = _surface(fits[k], count)
        others = [reach(surface, np.zeros(count), fit) for fit in (*fits[:k], *fits[k + 1 :])]
        outer = surface[np.all([each > 0.0 for each in others], axis=0)] if others else surface
        return np.maximum(self.nearby.query(outer)[0] - self.piece.swell.max(), 0.0)


class Groups(NamedTuple):
    """To which group each triangle of a sample belongs, their capsules, and how far these stand out, m."""

    group: Indices
    fits: list[Fit]
    excess: float


def covering(surfaces: Iterable[Patch], depth: dict[int, float]) -> tuple[Capsule, ...]:
    """Returns capsules that contain surfaces: each triangle lies wholly in one capsule of its body.

    depth: for each joint how near it is to the end of its chain, 0–1; capsules there are tighter.
    """
    ordered = sorted(surfaces, key=lambda patch: (patch.joint == 0, patch.joint))
    bodies = [
        _body(joint, list(own), 1.0 - _TAPER * (1.0 - depth[joint]))
        for joint, own in groupby(ordered, lambda patch: patch.joint)
    ]
    ways = [[_by_link(body)] for body in bodies]
    size = max((_extent(fit) for way in ways for fit in way[0].fits), default=0.0)
    for _ in range(int(PER_BODY * len(bodies)) - sum(len(way[0].fits) for way in ways)):
        open_ = [
            (way[-1].excess * body.weight, k)
            for k, (body, way) in enumerate(zip(bodies, ways, strict=True))
            if len(way[-1].fits) < min(body.most, len(way[-1].group)) and way[-1].excess > _SMALL * size
        ]
        if not open_:
            break
        k = max(open_)[1]
        ways[k].append(_divided(bodies[k], ways[k][-1]))
    return tuple(
        capsule
        for body, way in zip(bodies, ways, strict=True)
        for capsule in _capsules(body, min(way, key=lambda each: each.excess).fits)
    )


def _grouped(body: Body, group: Indices) -> Groups:
    fits = body.fits(group)
    return Groups(group, fits, body.excess(fits))


def _by_link(body: Body) -> Groups:
    """One group for each link, but for links that lie in the capsules of others; one if they are many."""
    group = body.sample.link.copy()
    if len(np.unique(group)) > MOST_LINKS:
        group[:] = 0
    group = np.unique(group, return_inverse=True)[1]
    while True:
        fits = body.fits(group)
        depths = np.array([reach(body.middles, body.sample.swell, fit) for fit in fits])
        inside = [
            k
            for k in range(len(fits))
            if len(fits) > 1 and (np.delete(depths, k, axis=0)[:, group == k].min(axis=0) < 0.0).all()
        ]
        if not inside:
            return Groups(group, fits, body.excess(fits))
        k = min(inside, key=lambda each: fits[each].volume)
        depths[k] = np.inf
        group = np.where(group == k, np.argmin(depths, axis=0), group)
        group = np.unique(group, return_inverse=True)[1]


def _slabs(body: Body, count: int) -> Iterator[Indices]:
    """Groups between planes at equal distances across each principal axis, and those of both ways of halving
    them."""
    offset = body.middles - body.middles.mean(axis=0)
    axes = np.linalg.svd(offset.T @ offset)[0].T
    share = [
        (z - z.min()) / max(float(np.ptp(z)), 1e-12) * 0.999999 for z in (offset @ axis for axis in axes)
    ]
    whole = [(first * count).astype(np.intp) for first in share]
    halved = [
        (first * (count // 2)).astype(np.intp) + (count // 2) * (second >= 0.5)
        for i, first in enumerate(share)
        for j, second in enumerate(share)
        if i != j and count >= 4 and count % 2 == 0
    ]
    for group in (*whole, *halved):
        if len(np.unique(group)) == count:
            yield group


def _divided(body: Body, groups: Groups) -> Groups:
    """The best groups that come from cutting one group in two, one more than before."""
    found: list[Groups] = []
    starts: list[tuple[float, Indices]] = []
    for k, fit in enumerate(groups.fits):
        own = np.flatnonzero(groups.group == k)
        for mask in _cuts(body.sample.part(own)):
            parts = [
                quick_fit(body.middles[own[side]], body.sample.swell[own[side]]) for side in (mask, ~mask)
            ]
            split = groups.group.copy()
            split[own[mask]] = len(groups.fits)
            starts.append((sum(each.volume for each in parts) - fit.volume, split))
    chosen = [split for _, split in sorted(starts, key=lambda each: each[0])[:_TRIED]]
    for split in (*chosen, *_slabs(body, len(groups.fits) + 1)):
        found.append(_improved(body, split))
    return min(found, key=lambda each: each.excess, default=groups)


def _improved(body: Body, group: Indices) -> Groups:
    """Gives triangles to the capsule in which they lie deepest, and fits again."""
    best = _grouped(body, group)
    count = len(best.fits)
    for _ in range(_ROUNDS):
        group = np.argmin([reach(body.middles, body.sample.swell, fit) for fit in best.fits], axis=0)
        if len(np.unique(group)) < count:
            break
        now = _grouped(body, group)
        if now.excess >= best.excess:
            break
        best = now
    return best


def _capsules(body: Body, fits: list[Fit]) -> Iterator[Capsule]:
    """The capsules that contain all triangles, for groups that contain a sample."""
    before = np.inf
    parts: list[Piece] = []
    for _ in range(3):
        depths = [reach(*_balls(body.piece), fit).reshape(-1, 3).max(axis=1) for fit in fits]
        chosen = np.argmin(depths, axis=0)
        now = [body.piece.part(chosen == k) for k in np.unique(chosen)]
        tight = [tight_fit(*_balls(piece)) for piece in now]
        if sum(fit.volume for fit in tight) >= before:
            break
        parts, fits, before = now, tight, sum(fit.volume for fit in tight)
    for piece, fit in zip(parts, fits, strict=True):
        yield Capsule(body.joint, body.names[_main(piece)], _point(fit.start), _point(fit.end), fit.radius)


def _surface(fit: Fit, count: int = 160) -> Array:
    """Points (count, 3), m, evenly on the surface of a capsule, in a spiral."""
    axis = fit.end - fit.start
    length = float(np.linalg.norm(axis))
    frame = np.linalg.svd(axis[None])[2][[1, 2, 0]]
    # The area of a ball or a cylinder between two heights is proportional to their difference.
    height = (length + 2.0 * fit.radius) * (np.arange(count) + 0.5) / count - fit.radius
    foot = np.clip(height, 0.0, length)
    ring = np.sqrt(np.maximum(fit.radius**2 - (height - foot) ** 2, 0.0))
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    local = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])
    return fit.start + local @ (frame * [[1.0], [1.0], [1.0 if axis @ frame[2] >= 0.0 else -1.0]])


def _extent(fit: Fit) -> float:
    return float(np.linalg.norm(fit.end - fit.start)) + 2.0 * fit.radius


def _body(joint: int, surfaces: list[Patch], weight: float) -> Body:
    names = tuple(dict.fromkeys(patch.link for patch in surfaces))
    corners = np.concatenate([patch.corners for patch in surfaces])
    swell = np.concatenate([np.full(len(patch.corners), patch.swell) for patch in surfaces])
    link = np.concatenate([np.full(len(patch.corners), names.index(patch.link)) for patch in surfaces])
    edge = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / _FINE
    return Body(joint, names, _cut(Piece(corners, swell, link), edge), weight)


def _cut(piece: Piece, edge: float) -> Piece:
    """Halves the longest edges of triangles until they are short, or there are enough triangles."""
    done: list[Piece] = []
    count = 0
    while len(piece.swell):
        corners = piece.corners
        lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = lengths.max(axis=1) > edge
        done.append(piece.part(~long))
        count += len(done[-1].swell)
        rest = piece.part(long)
        if count + 2 * len(rest.swell) > _LARGEST:
            done.append(rest)
            break
        first = lengths[long].argmax(axis=1)
        rows = np.arange(len(first))
        a, b, c = (rest.corners[rows, (first + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        halves = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        piece = Piece(halves, np.tile(rest.swell, 2), np.tile(rest.link, 2))
    return Piece(*(np.concatenate(each) for each in zip(*done, strict=True)))


def _cuts(piece: Piece) -> Iterator[Mask]:
    """Ways to split triangles in two: along their principal axes, and one link from the others."""
    middles = piece.corners.mean(axis=1)
    offset = middles - middles.mean(axis=0)
    for axis in np.linalg.svd(offset.T @ offset)[0].T:
        z = offset @ axis
        for share in _CUTS:
            mask = z < z.min() + share * np.ptp(z)
            if mask.any() and not mask.all():
                yield mask


def _balls(piece: Piece) -> tuple[Array, Array]:
    return piece.corners.reshape(-1, 3), np.repeat(piece.swell, 3)


def _main(piece: Piece) -> int:
    """The link with the largest area."""
    return int(np.bincount(piece.link, weights=_areas(piece) + 1e-12).argmax())


def _areas(piece: Piece) -> Array:
    """(F,), m²."""
    a, b, c = piece.corners.swapaxes(0, 1)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _point(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
