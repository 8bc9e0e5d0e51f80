"""M̄ that looks after itself: one factor on it, from measured Δτ and Δq̈.

Over one period the robot answers Δq̈ = M⁻¹(Δτ − Δh), h gravity, Coriolis and friction. Weighted by the M̄ that
was set, u = M̄^-½ Δτ and y = M̄^½ Δq̈ are y = S u + what Δh does, with S = M̄^½ M⁻¹ M̄^½: symmetric, positive
definite, its eigenvalues those of M⁻¹M̄. S is found by least squares over the last half second,

    Ŝ = (Σ y uᵀ + μ 1)(Σ u uᵀ + μ 1)⁻¹,

where μ stands for what is too faint to count: in directions that nothing has moved Ŝ stays 1, as if M̄ were
M. The factor σ aims at 1/λ_max(Ŝ), within 1 … LARGEST; it rises by RISE a second at most and falls at once.

Why that stays stable. Without the limits, time-delay estimation multiplies its error by 1 − M⁻¹M̄ from tick
to tick (Remark 4); weighted and with the factor, by 1 − σ_k S. All of these share the eigenvectors of S: as
long as σ_k λ_max(S) < 2 each of them shrinks the weighted error's Euclidean norm, and so does their product,
in any order and however fast σ moves. (With a factor per joint they would share no norm, and a product of
contractions may grow: hence one factor.) σ_k λ_max(S) stays below 2 while λ_max(Ŝ) is more than half of
λ_max(S). Where Ŝ falls short of that, as when the arm folds to where it is light, what grows is the very
mode of λ_max, with the other sign at every tick. Soon it outweighs everything else in u and y, where Δh
hardly changes: S is then measured in just that direction, and σ falls within EVERY ticks, to 1 at the least,
where the loop is the one that was set. That M, and so S, changes with the configuration is a disturbance
here, as it is in Remark 4.

What it cannot do. An M̄ that is unstable as it was set stays so. A sensor's rounding comes back through Δτ
and looks like a robot that is too light: σ goes to 1. A delay of the torque by whole periods hides what Δτ
did.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST = 4.0
"""The factor stays from 1, M̄ as it was set, to this."""
RISE = 5.0
"""1/s: the factor grows by at most this share of itself in a second; it falls at once."""
MEMORY = 0.5
"""s: after this time a measurement counts 1/e."""
EVERY = 5
"""Ticks from one look at Ŝ to the next."""
FAINT = 0.1
"""rad/s² or m/s²: changes of acceleration by less than this are told from nothing."""
_UNEXCITED = 1e-6
"""A direction with less than this share of all that was measured counts as unmoved."""


class Adaptation(NamedTuple):
    """What is known at a tick.

    Attributes:
        factor: on the M̄ that was set, 1 … LARGEST.
        v: measured velocity, (n,).
        tau: torque that acted until this tick, (n,) N·m.
        acceleration: of the last period, (n,); None: not known.
        uu, yu: Σ u uᵀ and Σ y uᵀ, (n, n).
        ticks: how many were measured.
    """

    factor: float
    v: Array
    tau: Array
    acceleration: Array | None
    uu: Array
    yu: Array
    ticks: int = 0

    @classmethod
    def start(cls, v: Array, tau: Array) -> Adaptation:
        """Nothing is known: the factor is 1."""
        none = np.zeros((v.size, v.size))
        return cls(1.0, v, tau, None, none, none)


def measured(before: Adaptation, v: Array, tau: Array, period: float, M_bar: Array) -> Adaptation:
    """What is known one period later.

    Args:
        before: at the tick before.
        v: measured velocity, (n,).
        tau: torque that acted during the period, (n,) N·m.
        period: s.
        M_bar: diagonal of M̄ as it was set, (n,) kg·m².
    """
    acceleration = (v - before.v) / period
    if before.acceleration is None:
        return before._replace(v=v, tau=tau, acceleration=acceleration)
    root = np.sqrt(M_bar)
    u, y = (tau - before.tau) / root, (acceleration - before.acceleration) * root
    left = math.exp(-period / MEMORY)
    uu, yu = left * before.uu + u[:, None] * u, left * before.yu + y[:, None] * u
    factor, ticks = before.factor, before.ticks + 1
    if ticks % EVERY == 0:
        aim = min(max(1.0 / largest_eigenvalue(uu, yu, FAINT**2 * M_bar), 1.0), LARGEST)
        factor = min(aim, factor * (1.0 + RISE * EVERY * period))
    return Adaptation(factor, v, tau, acceleration, uu, yu, ticks)


def largest_eigenvalue(uu: Array, yu: Array, faint: Array) -> float:
    """λ_max of the symmetric part of Ŝ; ∞ if it is not finite.

    Args:
        uu, yu: Σ u uᵀ and Σ y uᵀ, (n, n).
        faint: what a joint's Σ u² is compared with, at least, (n,).
    """
    mu = np.diag(faint + _UNEXCITED * float(np.trace(uu)))
    found = np.linalg.solve(uu + mu, (yu + mu).T)
    found = 0.5 * (found + found.T)
    return float(np.linalg.eigvalsh(found)[-1]) if math.isfinite(float(found.sum())) else math.inf
