"""Sensors are coarse: the effect of finite differences on a rounding error."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question

M_BAR = 0.033
T_S = 1e-3


def digit(degrees: float, T: float = T_S) -> float:
    """Returns the torque, N·m, that one digit of an encoder, degrees, causes."""
    return M_BAR * math.radians(degrees) / T**2


def _differences(rng: np.random.Generator) -> tuple[float, float]:
    q, delta = np.zeros(3), rng.uniform(1e-5, 1e-3)
    q[2] = delta
    v = np.diff(q) / T_S
    return float(np.diff(v)[0] / T_S), delta / T_S**2


def _spread(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the RMS over independent rounding errors, and δ/(√2 T_s²)."""
    delta = rng.uniform(1e-5, 1e-3)
    errors = rng.uniform(-0.5 * delta, 0.5 * delta, size=(400_000, 3))
    a = errors @ np.array([1.0, -2.0, 1.0]) / T_S**2
    return float(np.sqrt(np.mean(a**2))), delta / (math.sqrt(2) * T_S**2)


def _torque(rng: np.random.Generator) -> tuple[float, float]:
    a, error = rng.normal(size=2)
    return M_BAR * (a - (0.0 + error)) - M_BAR * a, -M_BAR * error


def _scaling(rng: np.random.Generator) -> tuple[float, float]:
    d, k = rng.uniform(1e-3, 1e-2), rng.uniform(1, 5)
    return digit(d, k * T_S) / digit(d), 1 / k**2


FURTHER = Further(
    derivation=(
        Line(
            r"Position is read in multiples of $\delta$ (one digit); velocity and acceleration are "
            r"differences of readings. The second formula is the acceleration if the last reading is one "
            r"digit larger and the readings before it are equal:",
            r"\ddot q_k = \frac{q_k - 2 q_{k-1} + q_{k-2}}{T_s^2}, \qquad "
            r"\text{one digit: } \frac{\delta}{T_s^2}",
            _differences,
        ),
        Line(
            r"While the joint moves on through many digits, rounding errors are spread evenly over "
            r"$\pm\delta/2$, each of variance $\delta^2/12$. The sum of three independent errors with the "
            r"weights $1, -2, 1$ has six times this variance:",
            r"\operatorname{rms} \ddot q = \frac{1}{T_s^2} \sqrt{(1 + 4 + 1)\, \frac{\delta^2}{12}} "
            r"= \frac{\delta}{\sqrt 2\, T_s^2}",
            _spread,
            1e-2,
        ),
        Line(
            r"A deadbeat controller answers $\Delta\tau = \bar M (a - \ddot q_0)$, so an error of $\ddot "
            r"q_0$ goes into the "
            "torque as it is:",
            r"\delta(\Delta\tau) = -\bar M\, \delta(\ddot q_0)",
            _torque,
        ),
        Line(
            r"The period enters squared, and $\bar M$ and $\delta$ once:",
            r"\frac{\bar M \delta}{(k T_s)^2} = \frac{1}{k^2}\, \frac{\bar M \delta}{T_s^2}",
            _scaling,
        ),
    ),
    questions=(
        Question(
            r"$\bar M = 0.033$ kg·m², $T_s = 1$ ms. To which torque does one digit of 0.005° correspond, "
            r"and one of 0.00125°, the encoder of the paper's arm?",
            r"$\bar M \delta/T_s^2 = ⟨coarse⟩$ and $⟨paper⟩$ N·m; the motor has 4 N·m.",
            {"coarse": (digit(0.005), ".1f"), "paper": (digit(0.00125), ".2f")},
        ),
        Question(
            "With which period does one digit of 0.005° correspond to 0.1 N·m? What is the disadvantage of "
            "this period?",
            r"$T_s = \sqrt{\bar M \delta/0.1} = ⟨T⟩$ ms. Errors along a curve grow with $T_s$ (*No model "
            r"needed*, last line): the desired acceleration changes more from step to step.",
            {"T": (1e3 * math.sqrt(M_BAR * math.radians(0.005) / 0.1), ".1f")},
        ),
        Question(
            "The encoder of 0.005° is put on the motor's side of a gear of 100 : 1. To which torque does a "
            "digit correspond at the joint now? Which $T_s$ would have the same effect?",
            "To a hundredth of the torque: ⟨digit⟩ N·m. With $T_s$ alone it would take ten times the "
            "period, since it enters squared. (A real gear has play and bends, which is another error.)",
            {"digit": (digit(0.005 / 100), ".3f")},
        ),
    ),
)
