"""A redundant arm: the null space of its Jacobian, and its dimension."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question, measured, planar

STRAIGHT = planar(np.zeros(3))[1]
ELBOW = measured("a-redundant-arm", "Joint 3 turns by more than 20°.")


def _difference(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    q, v, h = rng.normal(size=3), rng.normal(size=3), 1e-6
    return (planar(q + h * v)[0] - planar(q - h * v)[0]) / (2 * h), planar(q)[1] @ v


def _all_solutions(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J, x, z = rng.normal(size=(6, 7)), rng.normal(size=6), rng.normal(size=7)
    inverse = np.linalg.pinv(J)
    return J @ (inverse @ x + (np.eye(7) - inverse @ J) @ z), x


def _freedoms(rng: np.random.Generator) -> tuple[float, float]:
    J = rng.normal(size=(6, 7))
    J[5] = J[4]  # a linearly dependent row
    return float(np.trace(np.eye(7) - np.linalg.pinv(J) @ J)), 7.0 - np.linalg.matrix_rank(J)


def _torques(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J, z, M_bar = rng.normal(size=(6, 7)), rng.normal(size=7), np.diag(rng.uniform(0.01, 1.0, 7))
    free = M_bar @ (np.eye(7) - np.linalg.pinv(J) @ J) @ z
    return J @ np.linalg.inv(M_bar) @ free, np.zeros(6)


FURTHER = Further(
    derivation=(
        Line(
            "The position of the hand is a function of the joint angles, $x = f(q)$ (2). The chain rule "
            "gives the velocity of the hand (3):",
            r"\dot x = \frac{\partial f}{\partial q}\,\dot q = J(q)\,\dot q",
            _difference,
            1e-6,
        ),
        Line(
            "Let $J^+$ be the pseudoinverse of $J$. If $J$ has full rank, the following joint velocity "
            r"gives the hand the velocity $\dot x$, for any vector $z$:",
            r"\dot q = J^+ \dot x + (I - J^+ J)\,z \quad\Rightarrow\quad J \dot q = \dot x",
            _all_solutions,
        ),
        Line(
            "The matrix $I - J^+ J$ projects onto the null space of $J$. The trace of this matrix is the "
            "number of motions that are left over. A coordinate that repeats another coordinate does not "
            "reduce this number:",
            r"\operatorname{tr}(I - J^+ J) = n - \operatorname{rank} J",
            _freedoms,
        ),
        Line(
            "The controller computes torques. By (13) a change of torque changes the acceleration of the "
            r"hand by $J \bar M^{-1} \Delta\tau$. The following changes of torque do not move the hand:",
            r"\Delta\tau = \bar M (I - J^+ J)\,z \quad\Rightarrow\quad J \bar M^{-1} \Delta\tau = 0",
            _torques,
        ),
    ),
    questions=(
        Question(
            "A seven-joint arm holds a glass. Two tasks control the position of the glass and keep the "
            "glass upright. The rotation of the glass about its own axis is free. How many motions are left "
            "over? How many are left over if two levels contain the task *upright*?",
            "The position has three coordinates and *upright* has two: $7 - 5 = 2$. If *upright* appears "
            "twice, the number is the same: the rank of all rows counts, not the number of rows.",
        ),
        Question(
            "The planar arm has three links of 0.3 m and is stretched along $x$. What is its Jacobian, and "
            "which rank does the Jacobian have? Which joint velocities leave the hand at rest?",
            "No joint moves the hand along $x$. Along $y$ the joints have levers of ⟨l1⟩, ⟨l2⟩ and ⟨l3⟩ m. "
            "The rank is ⟨rank⟩, so two motions are free, one more than in any bent pose. Examples are the "
            "joint velocities $(1, -⟨back⟩, 0)$ and $(1, 0, -⟨far⟩)$.",
            {
                "l1": (STRAIGHT[1, 0], ".1f"),
                "l2": (STRAIGHT[1, 1], ".1f"),
                "l3": (STRAIGHT[1, 2], ".1f"),
                "rank": (float(np.linalg.matrix_rank(STRAIGHT)), ".0f"),
                "back": (STRAIGHT[1, 0] / STRAIGHT[1, 1], ".1f"),
                "far": (STRAIGHT[1, 0] / STRAIGHT[1, 2], ".0f"),
            },
        ),
        Question(
            "In *Drag the elbow*, joint 3 is asked to turn by 60°. How far does the joint turn, and why "
            "does it not turn further?",
            "Joint 3 turns by ⟨turn⟩°, ⟨share⟩ % of the desired angle. The posture task has seven targets: "
            "joint 3 is to turn, and the other six joints are to stay. But only one motion is free. Level 3 "
            "uses this motion until it cannot reduce the sum of the squared errors of the seven joints "
            "further. There the vector of the errors is perpendicular to the free motion.",
            {"turn": (ELBOW, ".0f"), "share": (100 * ELBOW / 60, ".0f")},
        ),
    ),
)
