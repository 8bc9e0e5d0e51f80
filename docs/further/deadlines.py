"""Deadlines: the effect of one tick of delay on time-delay estimation."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question

MU = 0.1


def _run(mu: float, ticks: int, late: int) -> np.ndarray:
    """Returns the error of the acceleration at each tick, if the torque of tick k acts from k + 1 + late on;
    M = 1, M̄ = μ."""
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
    """Returns whether errors vanish, without and with delay (columns), below and above μ = 2 (rows)."""
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
            r"One tick late, $\tau_{k+2} = \tau_k + \bar M (a - \ddot q_k)$: it corrects the error of the "
            r"torque before the previous one. The even and the odd ticks are two independent sequences:",
            r"\varepsilon_{k+2} = (1 - \mu)\,\varepsilon_k \quad\Rightarrow\quad "
            r"\varepsilon_k = (1 - \mu)^{\lfloor k/2 \rfloor}\, \varepsilon_0",
            _late,
        ),
        Line(
            r"This is a loop of half the rate. With $2 \bar M$ the share $1 - 2\mu$ of an error is left "
            r"after two late ticks. With $\bar M$ two ticks in time leave $(1 - \mu)^2$, almost the same:",
            r"(1 - \mu)^2 - (1 - 2\mu) = \mu^2",
            _bought,
        ),
        Line(
            r"But the stability limit is $\mu = 2$ in both cases, and doubling $\bar M$ doubles $\mu$, which "
            r"comes closer to it:",
            r"\varepsilon_k \to 0 \quad\Leftrightarrow\quad 0 < \mu < 2",
            _cliff,
        ),
    ),
    questions=(
        Question(
            r"A mode with $\mu = 0.1$. After how many milliseconds is a hundredth (0.01) of an error "
            r"left, in time and one "
            "tick late?",
            r"$(1 - 0.1)^k = 0.01$ at $k = ⟨k⟩$: ⟨k⟩ ms, and twice as long, ⟨late⟩ ms, one tick late.",
            {
                "k": (float(math.ceil(math.log(0.01) / math.log(1 - MU))), ".0f"),
                "late": (2.0 * math.ceil(math.log(0.01) / math.log(1 - MU)), ".0f"),
            },
        ),
        Question(
            r"The same mode, one tick late, $\bar M$ doubled. How long does it take now? And which "
            r"disadvantage has the doubling for the largest mode of this arm, if its $\mu$ is 0.8?",
            r"$(1 - 0.1 - 0.1)^k = 0.01$ at $k = ⟨k⟩$, so ⟨ms⟩ ms: the loss is compensated. The largest "
            r"mode goes from $\mu = 0.8$ to $⟨mu⟩$: its error now changes its sign at every correction, and "
            r"the distance to the stability limit 2 is $⟨room⟩$.",
            {
                "k": (float(math.ceil(math.log(0.01) / math.log(1 - 2 * MU))), ".0f"),
                "ms": (2.0 * math.ceil(math.log(0.01) / math.log(1 - 2 * MU)), ".0f"),
                "mu": (2 * 0.8, ".1f"),
                "room": (2 - 2 * 0.8, ".1f"),
            },
        ),
        Question(
            "A computer needs 0.1 ms for each knot. How many knots can it afford with 1 ms, 2 ms and 5 ms? "
            "And how many can a computer afford that needs 0.4 ms for each knot, with 1 ms?",
            "⟨a⟩, ⟨b⟩ and ⟨c⟩; the slow computer affords ⟨d⟩. Whether more knots are useful is another "
            "question: in *How far ahead* a longer horizon improved little, and here it halves the rate of "
            "the loop.",
            {
                "a": (1 / 0.1, ".0f"),
                "b": (2 / 0.1, ".0f"),
                "c": (5 / 0.1, ".0f"),
                "d": (float(math.floor(1 / 0.4)), ".0f"),
            },
        ),
    ),
)
