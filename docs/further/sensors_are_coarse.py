"""Sensors are coarse: the effect of finite differences on a rounding error."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question

M_BAR = 0.033
T_S = 1e-3


def digit(degrees: float, T: float = T_S) -> float:
    """Returns the torque, N·m, for one digit of an encoder that has a digit of this size in degrees."""
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
            r"An encoder reports the position in multiples of $\delta$ (one digit). Velocity and "
            "acceleration are differences of these readings. The second formula is the acceleration if the "
            "last reading is one digit larger than the two equal readings before it:",
            r"\ddot q_k = \frac{q_k - 2 q_{k-1} + q_{k-2}}{T_s^2}, \qquad "
            r"\text{one digit: } \frac{\delta}{T_s^2}",
            _differences,
        ),
        Line(
            "While the joint moves through many digits, the rounding errors are spread evenly over "
            r"$\pm\delta/2$. Each error has the variance $\delta^2/12$. The sum of three independent errors "
            "with the weights $1, -2, 1$ has six times this variance:",
            r"\operatorname{rms} \ddot q = \frac{1}{T_s^2} \sqrt{(1 + 4 + 1)\, \frac{\delta^2}{12}} "
            r"= \frac{\delta}{\sqrt 2\, T_s^2}",
            _spread,
            1e-2,
        ),
        Line(
            r"A deadbeat controller computes $\Delta\tau = \bar M (a - \ddot q_0)$, so an error of $\ddot "
            "q_0$ acts on the torque in full:",
            r"\delta(\Delta\tau) = -\bar M\, \delta(\ddot q_0)",
            _torque,
        ),
        Line(
            r"The torque of one digit is in proportion to $\bar M$ and $\delta$, and inversely proportional "
            "to the square of the period:",
            r"\frac{\bar M \delta}{(k T_s)^2} = \frac{1}{k^2}\, \frac{\bar M \delta}{T_s^2}",
            _scaling,
        ),
    ),
    questions=(
        Question(
            r"Let $\bar M = 0.033$ kg·m² and $T_s = 1$ ms. To which torque does one digit of 0.005° "
            "correspond? And to which torque does one digit of 0.00125° correspond, as in the encoders of "
            "the paper's arm?",
            r"$\bar M \delta/T_s^2$ is $⟨coarse⟩$ and $⟨paper⟩$ N·m. The motor can produce 4 N·m.",
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
            "The encoder of 0.005° is moved to the motor side of a gear of 100 : 1. To which torque at the "
            "joint does a digit correspond now? Which $T_s$ would have the same effect without the gear?",
            "A digit corresponds to a hundredth of the torque, ⟨digit⟩ N·m. Without the gear, ten times the "
            "period would have the same effect, since the period enters squared. (A real gear has play and "
            "bends, which adds another error.)",
            {"digit": (digit(0.005 / 100), ".3f")},
        ),
    ),
)
