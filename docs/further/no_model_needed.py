"""No model needed: time-delay estimation and the map of its error."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, inertia, measured

LEFT = 1 - 0.033 / 0.1


def _plant(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    return inertia(rng, 4), np.diag(rng.uniform(0.5, 3.0, 4)), *rng.normal(size=(3, 4))


def _lumped(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar, forces, tau, _ = _plant(rng)
    a = np.linalg.solve(M, tau - forces)
    return M_bar @ a + ((M - M_bar) @ a + forces), tau


def _delayed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar, forces, tau_0, _ = _plant(rng)
    a_0 = np.linalg.solve(M, tau_0 - forces)
    return tau_0 - M_bar @ a_0, (M - M_bar) @ a_0 + forces


def _mapped(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar, forces, tau_0, wanted = _plant(rng)
    a_0 = np.linalg.solve(M, tau_0 - forces)
    a = np.linalg.solve(M, tau_0 + M_bar @ (wanted - a_0) - forces)
    return a - wanted, (np.eye(4) - np.linalg.solve(M, M_bar)) @ (a_0 - wanted)


def _real(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar = _plant(rng)[:2]
    root = np.sqrt(M_bar)
    plain = np.sort(np.linalg.eigvals(np.eye(4) - np.linalg.solve(M, M_bar)).real)
    return plain, np.sort(1 - np.linalg.eigvalsh(root @ np.linalg.solve(M, root)))


def _ramp(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar, _, _, change = _plant(rng)
    a, wanted = np.zeros(4), np.zeros(4)
    for _ in range(2000):
        wanted = wanted + change
        a = a + np.linalg.solve(M, M_bar @ (wanted - a))
    return a - wanted, -(np.linalg.solve(M_bar, M) - np.eye(4)) @ change


FURTHER = Further(
    derivation=(
        Line(
            r"The arm obeys $M \ddot q + n = \tau$, where $n$ contains all forces except inertia. Add and "
            r"subtract $\bar M \ddot q$ (6):",
            r"\bar M \ddot q + \underbrace{(M - \bar M)\,\ddot q + n}_{H_q} = \tau",
            _lumped,
        ),
        Line(
            "Nothing has been assumed so far. The value of $H_q$ one millisecond ago can be computed from "
            "two known quantities, the torque that acted and the acceleration that it produced (9):",
            r"(H_q)_0 = \tau_0 - \bar M \ddot q_0",
            _delayed,
        ),
        Line(
            r"Use this value as the present one. For the desired acceleration $a$ this gives $\Delta\tau = "
            r"\bar M (a - \ddot q_0)$. If $M$ and $n$ have hardly changed meanwhile, $M(\ddot q - \ddot "
            r"q_0) = \Delta\tau$, thus",
            r"\ddot q - a = (I - M^{-1} \bar M)(\ddot q_0 - a)",
            _mapped,
        ),
        Line(
            r"An error shrinks if the eigenvalues of $I - M^{-1}\bar M$ lie between −1 and 1. They are "
            r"real, since $M^{-1} \bar M$ is similar to a symmetric matrix:",
            r"\operatorname{eig}(I - M^{-1} \bar M) = 1 - \operatorname{eig}(\bar M^{1/2} M^{-1} \bar "
            r"M^{1/2})",
            _real,
        ),
        Line(
            r"If the desired acceleration changes by $\delta$ in every step, as along any curve, the error "
            r"does not vanish. It converges to the value that one more step does not change:",
            r"\ddot q - a \;\to\; -(\bar M^{-1} M - I)\,\delta",
            _ramp,
            1e-6,
        ),
    ),
    questions=(
        Question(
            r"A joint has $M = 0.1$ kg·m² and $\bar M = 0.033$ kg·m². A load is added. After how many "
            "milliseconds is less than a hundredth (0.01) of the error in its acceleration left?",
            r"Each step leaves the share $1 - \bar M/M = ⟨left⟩$ of the error. $⟨left⟩^k < 0.01$ from $k = "
            "⟨k⟩$ on, that is, after ⟨k⟩ ms.",
            {"left": (LEFT, ".2f"), "k": (float(math.ceil(math.log(0.01) / math.log(LEFT))), ".0f")},
        ),
        Question(
            r"The same joint has $M = 0.1$ kg·m². Which $\bar M$ removes the whole error in one step? From "
            r"which $\bar M$ on does the error grow?",
            r"$\bar M = M = 0.1$ kg·m² removes the whole error. With a larger $\bar M$ the error changes "
            r"its sign in every step, and from $\bar M = 2 M = ⟨edge⟩$ kg·m² on the error grows. That is "
            r"why $\bar M$ is raised in small steps: the best value is only half of the value at which the "
            "loop becomes unstable.",
            {"edge": (2 * 0.1, ".1f")},
        ),
        Question(
            r"On the iiwa the gauge shows 0.985 with $\bar M$ and 0.94 with four times this $\bar M$. After "
            "how many milliseconds is a tenth of the slowest component of an error left? What does the last "
            "line of the derivation say about an error along a curve?",
            r"It takes $⟨slow⟩$ ms with $\bar M$ and $⟨fast⟩$ ms with four times this $\bar M$. Along a "
            r"curve the error is about $M/\bar M$ times the change of acceleration per step, so with four "
            r"times this $\bar M$ a quarter of the error or less is left: *Beyond the proof* measures "
            "⟨left⟩.",
            {
                "left": (measured("no-model-needed", "The largest error is at most a quarter"), ".2f"),
                "slow": (math.log(0.1) / math.log(0.985), ".0f"),
                "fast": (math.log(0.1) / math.log(0.94), ".0f"),
            },
        ),
    ),
)
