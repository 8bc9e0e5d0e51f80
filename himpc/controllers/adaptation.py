"""Adaptation of M̄: the payload is estimated from the gravity torque, and M̄ is fitted to the payload.

While the robot moves, the applied torque is on average the torque that holds the robot: τ ≈ g(q) + m φ(q),
with g the nominal model's gravity (`Settings.nominal`) and φ the additional gravity torque of one kilogram at
the tip. The payload m is found by least squares over the last LAG seconds, with each joint's torque divided
by its limit:

    m̂ = Σ φᵀ(τ − g) / (Σ φᵀφ + μ), at least 0.

The inertia is linear in the payload, M̂ = M_n(q) + m̂ Φ(q). The set value M̄⁰ is increased for each joint
whose inertia the payload increases. Then a common factor sets the largest eigenvalue of M̂⁻¹M̄ to one:

    M̄ᵢ = σ M̄ᵢ⁰ M̂ᵢᵢ/M_nᵢᵢ, σ = 1/λ_max.

M̄ stays below LARGEST times the set value, rises at most by RISE per second and falls at once. While no
bound is active, time-delay estimation multiplies its error by 1 − M⁻¹M̄ from tick to tick (Remark 4), which
requires eigenvalues of M⁻¹M̄ between 0 and 2. By construction M̄ ⪯ M̂, so with M the robot's own inertia

- where M ⪰ M̂, for example if the payload is underestimated, no eigenvalue exceeds 1;
- no eigenvalue reaches 2 as long as M ≻ ½M̂; the bound is reached with links of half the mass, or after a
  payload is dropped, while it is still in the estimate.

These statements hold for a constant M̄. When the arm moves, the change of M̄ acts as a disturbance, like the
change of M in Remark 4; `himpc-lab reproduce himpc-adaptation` shows its effect.

The estimate uses no derivative, and a coarse encoder does not disturb it. The estimate is disturbed by
lasting friction in τ and by a wrong nominal model; a payload whose weight loads no joint is not detected (m̂
stays 0).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots import NominalModel, Robot
from robots.nominal import NominalSettings

Array = NDArray[np.float64]

LARGEST = 6.0
"""Upper limit of M̄ of a joint, relative to the value that was set."""
RISE = 5.0
"""1/s: largest relative growth rate of M̄; a decrease takes effect at once."""
LAG = 0.1
"""s: time after which the weight of a measurement has fallen to 1/e."""
EVERY = 5
"""Number of ticks between two evaluations of the model."""
FAINT = 1e-5
"""μ: with this value, a payload is detected if a kilogram loads the joints with 0.3 % of their torque limits.
With larger loads the estimate is slightly too small."""


class LoadModel:
    """The nominal model as a function of the payload.

    Raises InputError for nominal settings of the wrong length.
    """

    def __init__(self, robot: Robot, nominal: NominalSettings) -> None:
        self._without = NominalModel(robot, nominal)
        self._with = NominalModel(robot, replace(nominal, payload_kg=nominal.payload_kg + 1.0))
        self._still = np.zeros(robot.n)
        self.tau_limit = robot.tau_limit

    def inertia(self, q: Array) -> tuple[Array, Array]:
        """Returns M_n, and Φ, the additional inertia per kilogram of payload, (n, n) kg·m² each."""
        M = self._without.mass_matrix(q)
        return M, self._with.mass_matrix(q) - M

    def gravity(self, q: Array) -> tuple[Array, Array]:
        """Returns g, and φ, the additional gravity torque per kilogram of payload, (n,) N·m each."""
        g = self._without.bias(q, self._still)
        return g, self._with.bias(q, self._still) - g


class Adaptation(NamedTuple):
    """The state of the adaptation at a tick.

    Attributes:
        M_bar: the diagonal in force, (n,) kg·m².
        pulled, pull: Σ φᵀ(τ − g) and Σ φᵀφ.
        ticks: number of ticks, used or skipped.
    """

    M_bar: Array
    pulled: float = 0.0
    pull: float = 0.0
    ticks: int = 0

    @property
    def payload_kg(self) -> float:
        """m̂."""
        return max(self.pulled / (self.pull + FAINT), 0.0)


def adapted(
    before: Adaptation, model: LoadModel, q: Array, tau: Array, period: float, M_bar: Array
) -> Adaptation:
    """Returns the state of the adaptation one period later.

    Args:
        before: state at the previous tick.
        model: the nominal model.
        q: measured position, (n,).
        tau: torque that acted during the period, (n,) N·m.
        period: s.
        M_bar: diagonal of M̄ as it was set, (n,) kg·m².
    """
    ticks = before.ticks + 1
    if ticks % EVERY:
        return before._replace(ticks=ticks)
    since = EVERY * period
    g, phi = model.gravity(q)
    phi, rest = phi / model.tau_limit, (tau - g) / model.tau_limit
    new = 1.0 - math.exp(-since / LAG)
    pulled = before.pulled + new * (float(phi @ rest) - before.pulled)
    pull = before.pull + new * (float(phi @ phi) - before.pull)
    known = Adaptation(before.M_bar, pulled, pull, ticks)
    aim = wanted(*model.inertia(q), known.payload_kg, M_bar)
    if not math.isfinite(float(aim.sum())):
        return before._replace(M_bar=M_bar, ticks=ticks)
    return known._replace(M_bar=np.minimum(aim, before.M_bar * (1.0 + RISE * since)))


def wanted(M: Array, Phi: Array, payload_kg: float, M_bar: Array) -> Array:
    """Returns M̄, (n,), scaled to λ_max(M̂⁻¹M̄) = 1 and then limited to LARGEST times the M̄ of the settings.

    Args:
        M, Phi: the nominal inertia, and the additional inertia per kilogram of payload, (n, n).
        payload_kg: m̂.
        M_bar: diagonal as it was set, (n,).
    """
    loaded = M + payload_kg * Phi
    shape = M_bar * np.diag(loaded) / np.diag(M)
    root = np.sqrt(shape)
    # 1/λ_max(M̂⁻¹M̄) is the smallest eigenvalue of M̄^-½ M̂ M̄^-½.
    smallest = float(np.linalg.eigvalsh(loaded / root[:, None] / root)[0])
    return np.minimum(shape * max(smallest, 0.0), LARGEST * M_bar) if smallest > 0.0 else M_bar.copy()
