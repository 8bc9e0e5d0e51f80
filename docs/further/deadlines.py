"""Deadlines: the effect of one tick of delay on time-delay estimation."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question

MU = 0.1


def _run(mu: float, ticks: int, late: int) -> np.ndarray:
    """Returns the error of the acceleration at each tick for M = 1 and M̄ = μ. The torque that tick k
    computes acts from tick k + 1 + late on."""
    wanted = 1.0
    torque = [0.0] * (ticks + 2)
    for k in range(ticks - late):
        torque[k + 1 + late] = torque[k] + mu * (wanted - torque[k])
    return np.array(torque[:ticks]) - wanted


def _in_time(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    mu = rng.uniform(0.05, 1.9)
    return _run(mu, 30, 0), -((1 - mu) ** np.arange(30))


def _late(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    mu = rng.uniform(0.05, 1.9)
    return _run(mu, 30, 1), -((1 - mu) ** (np.arange(30) // 2.0))


def _bought(rng: np.random.Generator) -> tuple[float, float]:
    mu = rng.uniform(0.01, 0.3)
    return (1 - mu) ** 2 - (1 - 2 * mu), mu**2


def _cliff(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns 1 where the error vanishes, else 0, and the expected values. Columns: without and with delay.
    Rows: μ below and above 2."""
    alive = [[abs(_run(mu, 4000, late)[-1]) < 1e-3 for late in (0, 1)] for mu in (1.98, 2.02)]
    return np.array(alive, float), np.array([[1.0, 1.0], [0.0, 0.0]])


FURTHER = Further(
    derivation=(
        Line(
            r"Take one mode of *No model needed* with the eigenvalue $\mu$ of $M^{-1} \bar M$, and a "
            r"constant desired acceleration. If each torque acts in time, it corrects the error of the "
            r"previous torque:",
            r"\varepsilon_{k+1} = (1 - \mu)\,\varepsilon_k \quad\Rightarrow\quad "
            r"\varepsilon_k = (1 - \mu)^k\, \varepsilon_0",
            _in_time,
        ),
        Line(
            r"If each torque acts one tick late, it is $\tau_{k+2} = \tau_k + \bar M (a - \ddot q_k)$. Each "
            "torque then corrects the error of the torque two ticks before. The even and the odd ticks are "
            "two independent sequences:",
            r"\varepsilon_{k+2} = (1 - \mu)\,\varepsilon_k \quad\Rightarrow\quad "
            r"\varepsilon_k = (1 - \mu)^{\lfloor k/2 \rfloor}\, \varepsilon_0",
            _late,
        ),
        Line(
            r"This is a loop of half the rate. With $2 \bar M$ and late torques, the share $1 - 2\mu$ of an "
            r"error is left after two ticks. With $\bar M$ and torques in time, the share $(1 - \mu)^2$ is "
            "left. The two shares are almost equal:",
            r"(1 - \mu)^2 - (1 - 2\mu) = \mu^2",
            _bought,
        ),
        Line(
            r"But the stability limit is $\mu = 2$ in both cases. If $\bar M$ is doubled, $\mu$ is doubled "
            "and is closer to this limit:",
            r"\varepsilon_k \to 0 \quad\Leftrightarrow\quad 0 < \mu < 2",
            _cliff,
        ),
    ),
    questions=(
        Question(
            r"A mode has $\mu = 0.1$, and a tick takes 1 ms. After how many milliseconds is a hundredth "
            "(0.01) of an error left if the torques act in time? And if they act one tick late?",
            "$(1 - 0.1)^k = 0.01$ at $k = ⟨k⟩$: it takes ⟨k⟩ ms in time, and twice as long, ⟨late⟩ ms, one "
            "tick late.",
            {
                "k": (float(math.ceil(math.log(0.01) / math.log(1 - MU))), ".0f"),
                "late": (2.0 * math.ceil(math.log(0.01) / math.log(1 - MU)), ".0f"),
            },
        ),
        Question(
            r"The torques act one tick late, but $\bar M$ is doubled. How long does the same mode take now "
            r"until a hundredth (0.01) of an error is left? Another mode of this arm has the largest $\mu$, "
            "0.8. Which disadvantage does the doubling have for that other mode?",
            "$(1 - 0.1 - 0.1)^k = 0.01$ at $k = ⟨k⟩$, so it takes ⟨ms⟩ ms: the doubling compensates for the "
            r"delay. The largest $\mu$ rises from 0.8 to $⟨mu⟩$. The error of this mode now changes its "
            r"sign at every correction, and $\mu$ is only $⟨room⟩$ below the stability limit 2.",
            {
                "k": (float(math.ceil(math.log(0.01) / math.log(1 - 2 * MU))), ".0f"),
                "ms": (2.0 * math.ceil(math.log(0.01) / math.log(1 - 2 * MU)), ".0f"),
                "mu": (2 * 0.8, ".1f"),
                "room": (2 - 2 * 0.8, ".1f"),
            },
        ),
        Question(
            "A computer needs 0.1 ms for each knot. How many knots can it compute within 1 ms, 2 ms and 5 "
            "ms? A slow computer needs 0.4 ms for each knot. How many knots can the slow computer compute "
            "within 1 ms?",
            "The first computer can compute ⟨a⟩, ⟨b⟩ and ⟨c⟩ knots, the slow computer ⟨d⟩. More knots need "
            "not be useful: in *How far ahead* a longer horizon improved little, and here it halves the "
            "rate of the loop.",
            {
                "a": (1 / 0.1, ".0f"),
                "b": (2 / 0.1, ".0f"),
                "c": (5 / 0.1, ".0f"),
                "d": (float(math.floor(1 / 0.4)), ".0f"),
            },
        ),
    ),
)
