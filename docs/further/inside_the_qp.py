"""Inside the QP: optimum, line, touching ellipse and active bound of one tick with N = 1."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question, null_space

Q, R = 200.0, 10.0
ROW = np.array([[-0.3, -0.2]]) / 0.033
ASKED = 12.0
FIRST = -Q * ROW[0] * ASKED / (Q * float(ROW[0] @ ROW[0]) + R)
WISH = np.array([0.05, 0.05])
ALONG = null_space(ROW)[:, 0]
SECOND = FIRST + ALONG * float(ALONG @ (WISH - FIRST))


def _optimum(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G, e = rng.normal(size=(1, 2)), rng.normal(size=1)
    H = Q * G.T @ G + R * np.eye(2)
    return -np.linalg.solve(H, Q * G.T @ e), -Q * G[0] * e / (Q * G[0] @ G[0] + R)


def _level_2(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    G, root, slope = rng.normal(size=(1, 2)), rng.normal(size=(2, 2)), rng.normal(size=2)
    H, Z, first = root @ root.T + np.eye(2), null_space(G), rng.normal(size=2)
    s = -np.linalg.solve(Z.T @ H @ Z, Z.T @ (H @ first + slope))
    return G, H, slope, Z, first, first + Z @ s


def _line(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G, _, _, _, first, second = _level_2(rng)
    return G @ second, G @ first


def _touching(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    _, H, slope, Z, _, second = _level_2(rng)
    return Z.T @ (H @ second + slope), np.zeros(1)


def _cut(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the derivative of level 2's least cost with respect to a bound, and minus the multiplier of
    this bound. The bound cuts the line before the optimum of level 2."""
    _, H, slope, Z, first, second = _level_2(rng)
    z = Z[:, 0]
    joint = int(np.argmax(np.abs(z)))
    sign = np.sign(second[joint] - first[joint])
    bound = first[joint] + 0.5 * (second[joint] - first[joint])

    def least(at: float) -> float:
        x = first + z * (at - first[joint]) / z[joint]
        return 0.5 * x @ H @ x + slope @ x

    cut = first + z * (bound - first[joint]) / z[joint]
    multiplier = -float(z @ (H @ cut + slope)) / (sign * z[joint])
    assert multiplier > 0
    h = 1e-6
    return (least(bound + sign * h) - least(bound - sign * h)) / (2 * h), -multiplier


FURTHER = Further(
    derivation=(
        Line(
            r"For $N = 1$ and one coordinate, $g = c_0 \bar M^{-1} J_1^\top$ is a vector in the plane. The "
            r"cost (31) of level 1 is $Q (e + g^\top \Delta\tau)^2 + R \lVert \Delta\tau \rVert^2$ and has "
            "the shape of a valley. Its optimum lies on the line through zero that is perpendicular to the "
            "valley:",
            r"\Delta\tau_1^* = -(Q g g^\top + R I)^{-1} Q g\, e = -\frac{Q e}{Q \lVert g \rVert^2 + R}\; g",
            _optimum,
        ),
        Line(
            r"(33) allows all $\Delta\tau_2 = \Delta\tau_1^* + z s$ with $z$ perpendicular to $g$. These "
            "points form the orange line:",
            r"g^\top \Delta\tau_2 = g^\top \Delta\tau_1^*",
            _line,
        ),
        Line(
            r"The cost of level 2, $\tfrac12 x^\top H x + h^\top x$, has ellipses as contours. On the line, "
            "the cost is least where an ellipse touches the line, that is, where the gradient of the cost "
            "is perpendicular to the line:",
            r"z^\top (H \Delta\tau_2^* + h) = 0",
            _touching,
        ),
        Line(
            r"If a side of the box, $a^\top \Delta\tau \le b$, cuts the line before that point, level 2 "
            r"stops at the cut. The gradient then has a component along the line, and this component gives "
            r"the multiplier of the bound:",
            r"\lambda = -\frac{z^\top (H \Delta\tau + h)}{z^\top a} > 0, \qquad "
            r"\frac{\partial \mathcal J_2^*}{\partial b} = -\lambda",
            _cut,
            1e-5,
        ),
    ),
    questions=(
        Question(
            r"Two joints have $\bar M = 0.033$ kg·m² and $J_1 = (-0.3, -0.2)$ m. Let $e = 12$ m/s², $Q = "
            "200$, $R = 10$ and $c_0 = 1$. Where is disc 1, the optimum of level 1?",
            r"$g = (⟨g1⟩, ⟨g2⟩)$, so $\Delta\tau_1^* = (⟨t1⟩, ⟨t2⟩)$ N·m. The torque of each joint is in "
            "proportion to its lever, and the effect of $R$ is not visible in three digits.",
            {
                "g1": (ROW[0, 0], ".2f"),
                "g2": (ROW[0, 1], ".2f"),
                "t1": (FIRST[0], ".3f"),
                "t2": (FIRST[1], ".3f"),
            },
        ),
        Question(
            "The contours of level 2 are circles around $(0.05, 0.05)$ N·m. In which direction does the "
            "line run, and where is disc 2, the optimum of level 2?",
            "The line is perpendicular to $g$ and runs in the direction $(⟨d1⟩, ⟨d2⟩)$. Disc 2 is the point "
            r"of the line that is nearest to the centre of the circles: $\Delta\tau_2^* = (⟨t1⟩, ⟨t2⟩)$ "
            r"N·m. Check: $J_1 \bar M^{-1}\Delta\tau_2^* = ⟨same⟩$ m/s², as for disc 1.",
            {
                "t1": (SECOND[0], ".3f"),
                "t2": (SECOND[1], ".3f"),
                "same": (float(ROW[0] @ SECOND), ".1f"),
                "d1": (0.2, ".1f"),
                "d2": (-0.3, ".1f"),
            },
        ),
        Question(
            "Now the torque of joint 1 can increase by at most 1.2 N·m. Which of the two discs does this "
            "bound affect, and how?",
            "It affects neither disc: both are below 1.2 N·m, at $⟨t1⟩$ and $⟨t2⟩$ N·m. A bound that is not "
            "reached has the multiplier zero and changes nothing, even if it is close.",
            {"t1": (FIRST[0], ".2f"), "t2": (SECOND[0], ".2f")},
        ),
    ),
)
