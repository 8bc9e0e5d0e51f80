"""How strict is strict: (12) implies (11), and the error of a tangent to a curve."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, planar


def _inner(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the amount by which plans that satisfy (12) violate (11), which is zero."""
    Q, best = rng.uniform(0.1, 3, size=(11, 3)), rng.normal(size=(11, 3))
    worst = 0.0
    for _ in range(200):
        e = best * rng.uniform(-1, 1, size=(11, 3))
        worst = max(worst, float(np.sum(Q * e**2) - np.sum(Q * best**2)))
    return worst, 0.0


def _bent(rng: np.random.Generator) -> tuple[float, float]:
    q, d = rng.normal(size=3), rng.normal(size=3)

    def off(step: float) -> float:
        moved = planar(q + step * d)[0] - planar(q)[0] - step * planar(q)[1] @ d
        return float(np.linalg.norm(moved))

    return off(2e-4) / off(1e-4), 4.0


def _allowed(rng: np.random.Generator) -> tuple[float, float]:
    bend, delta = rng.uniform(0.5, 3, 2)
    step = math.sqrt(2 * delta / bend)
    return 0.5 * bend * step**2, delta


def _flat(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J, Q = rng.normal(size=(3, 9)), np.diag(rng.uniform(0.1, 3, 3))
    return J.T @ Q @ np.zeros(3), np.zeros(9)


FURTHER = Further(
    derivation=(
        Line(
            "In a plan that satisfies (12), no $|e_{kp}|$ is larger than in the best plan of level $i$. "
            "Then no term of (8) is larger either, so the plan also satisfies (11):",
            r"|e_{kp}| \le |e_{kp}|^* \;\; \forall k, p \quad\Rightarrow\quad "
            r"\max\left(0,\; \mathcal J_i - \mathcal J_i^*\right) = 0",
            _inner,
        ),
        Line(
            r"The QP contains the linearization of $e$, which is a tangent. After a step of length $\alpha$ "
            "along the tangent, the distance from the curve is of second order: half the step gives a "
            "quarter of the distance.",
            r"\lVert f(q + \alpha d) - f(q) - \alpha J d \rVert = \tfrac12 \kappa\, \alpha^2 + O(\alpha^3)",
            _bent,
            5e-3,
        ),
        Line(
            r"This distance must be at most $\delta$ (13), so that the line search accepts only steps with",
            r"\tfrac12 \kappa \alpha^2 \le \delta \quad\Leftrightarrow\quad \alpha \le \sqrt{2 \delta / "
            r"\kappa}",
            _allowed,
        ),
        Line(
            r"For $\delta = 0$ the line search accepts no step at all. A cost without slope does not "
            "explain the short steps under (11). The third step of the lesson also tests a cost of "
            "level 1 that contains effort. This cost has a slope, but the steps are as short as before. "
            "Without effort the cost has no slope where level 1 is at its optimum with $e^* = 0$:",
            r"\nabla \mathcal J_1 = J^\top Q\, e^* = 0",
            _flat,
        ),
    ),
    questions=(
        Question(
            "A hand is to stay on a circle of radius 1 m and steps along the tangent. How long may the "
            "step be with $\\delta = 1$ mm, and with $\\delta = 1$ cm?",
            r"It leaves the circle by $\alpha^2/2$ (with $\kappa = 1$ 1/m), so $\alpha = \sqrt{2\delta}$. "
            "The step may be ⟨fine⟩ cm long with 1 mm, and ⟨rough⟩ cm with 1 cm. Ten times the tolerance "
            "allows three times the step.",
            {
                "fine": (100 * math.sqrt(2 * 0.001), ".1f"),
                "rough": (100 * math.sqrt(2 * 0.01), ".1f"),
            },
        ),
        Question(
            "The best plan of level 1 has an error of 1 cm at each of its eleven knots ($N = 10$). How "
            "large an error does (11) allow at a single knot, if all weights are equal?",
            "(11) allows the square root of eleven, ⟨all⟩ cm, if the error is zero at all other knots. (12) "
            "allows at most 1 cm at every knot.",
            {"all": (math.sqrt(11), ".1f")},
        ),
        Question(
            "In Table I of the paper, the error of the hand at high δ is 6.25 mm with (11) and 3.42 mm with "
            "(12). By how much is (12) better? Does this agree with the derivation?",
            "(12) is better by ⟨less⟩ %. The derivation says that (12) is the stricter one, so that the "
            "hand must be no worse. It does not say how much better the hand is, or whether the base "
            "profits. In the paper's formulation the best plan of level 1 is a compromise between error and "
            "effort, and the result depends on $Q$. In our runs (12) is worse for the hand with $Q = 1$, "
            "and better with $Q = 100$.",
            {"less": (100 * (1 - 3.42 / 6.25), ".0f")},
        ),
    ),
)
