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
            r"A plan that keeps (12) makes no $|e_{kp}|$ larger than it is in the best plan of level $i$. "
            r"Then no term of (8) is "
            "larger either, so it keeps (11):",
            r"|e_{kp}| \le |e_{kp}|^* \;\; \forall k, p \quad\Rightarrow\quad "
            r"\max\left(0,\; \mathcal J_i - \mathcal J_i^*\right) = 0",
            _inner,
        ),
        Line(
            r"The QP contains the linearization of $e$, a tangent. A step of length $\alpha$ along the "
            r"tangent leaves the curve by a term of second order: half the step has a quarter of the error,",
            r"\lVert f(q + \alpha d) - f(q) - \alpha J d \rVert = \tfrac12 \kappa\, \alpha^2 + O(\alpha^3)",
            _bent,
            5e-3,
        ),
        Line(
            r"so that the line search accepts, under (13),",
            r"\tfrac12 \kappa \alpha^2 \le \delta \quad\Leftrightarrow\quad \alpha \le \sqrt{2 \delta / "
            r"\kappa}",
            _allowed,
        ),
        Line(
            r"and no step at all for $\delta = 0$. For (11) one might also suspect that the cost has no "
            r"slope. This does not explain the short steps (third step of the lesson: where level 1 pays "
            r"for its effort, the cost has a slope, and the steps are as short). Where level 1 is at its "
            r"optimum with $e^* = 0$, its cost has no slope:",
            r"\nabla \mathcal J_1 = J^\top Q\, e^* = 0",
            _flat,
        ),
    ),
    questions=(
        Question(
            "A hand is to stay on a circle of radius 1 m and steps along the tangent. How long may the "
            "step be with $\\delta = 1$ mm, and with $\\delta = 1$ cm?",
            r"It leaves the circle by $\alpha^2/2$ (with $\kappa = 1$ 1/m), so $\alpha = \sqrt{2\delta}$: "
            r"⟨fine⟩ cm and ⟨rough⟩ cm. Ten times the tolerance allows three times the step.",
            {
                "fine": (100 * math.sqrt(2 * 0.001), ".1f"),
                "rough": (100 * math.sqrt(2 * 0.01), ".1f"),
            },
        ),
        Question(
            "(11) allows the cost of 1 cm at each of the eleven knots of a plan with $N = 10$. How large "
            "an error does it allow at a single knot, if all weights are equal?",
            "The square root of eleven, ⟨all⟩ cm, if the whole cost is that of one knot. (12) allows 1 cm "
            "there, and not more at any other knot.",
            {"all": (math.sqrt(11), ".1f")},
        ),
        Question(
            "The paper's Table I has 6.25 mm with (11) and 3.42 mm with (12) for the hand at high δ. By "
            "how much is (12) better there? Is that what the derivation says?",
            "By ⟨less⟩ %. The derivation says that (12) is the stricter one, so that the hand must be no "
            "worse; it does not say by how much, nor that the base profits. Under the paper's formulation "
            "level 1's best is a compromise between error and effort, and the order depends on $Q$: with 1 "
            "we find the hand worse under (12), with 100 better.",
            {"less": (100 * (1 - 3.42 / 6.25), ".0f")},
        ),
    ),
)
