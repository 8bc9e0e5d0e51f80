"""Swap the priorities: the freedom that (33) leaves to each level in each order."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured, null_space
from lessons.course import load_lesson
from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from robots import Plant

((_, ASKED),) = load_lesson("swap-the-priorities").steps[0].events
BENT = ASKED.value if isinstance(ASKED, MoveTarget) else ()
GONE = measured("swap-the-priorities", "In the end the hand is off by more than 10 cm.")


def _between_hands() -> float:
    """Returns the distance, mm, between the positions of the hand at home and in the desired posture."""
    scene = torque_scene("iiwa14-hold")
    plant, places = Plant(scene.robot), []
    for q in (scene.q_0, np.array(BENT)):
        plant.reset(q)
        places.append(plant.frame_pose(scene.robot.tip)[1].copy())
    return 1e3 * float(np.linalg.norm(places[1] - places[0]))


def _dimension(rng: np.random.Generator) -> tuple[float, float]:
    stack = rng.normal(size=(6, 7))
    return float(null_space(stack).shape[1]), 7.0 - np.linalg.matrix_rank(stack)


def _all_taken(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M_bar, first = np.diag(rng.uniform(0.01, 1.0, 7)), rng.normal(size=7)
    # (33) with J_p = I, solved for Δτ_i.
    return np.linalg.solve(np.linalg.inv(M_bar), np.linalg.solve(M_bar, first)), first


def _at_rest(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    G = [rng.normal(size=(m, 7)) for m in (3, 3, 7)]
    found = []
    for order in ((0, 1, 2), (2, 0, 1), (1, 2, 0)):
        at, Z = np.zeros(7), np.eye(7)
        for level in order:
            H, slope = 200 * G[level].T @ G[level] + 10 * np.eye(7), np.zeros(7)
            at = at - Z @ np.linalg.solve(Z.T @ H @ Z + 1e-12 * np.eye(Z.shape[1]), Z.T @ (H @ at + slope))
            Z = Z @ null_space(G[level] @ Z)
            if not Z.size:
                break
        found.append(at)
    return np.array(found), np.zeros((3, 7))


FURTHER = Further(
    derivation=(
        Line(
            r"Level $i$ may choose any $\Delta\tau_i$ that satisfies (33) for all levels $p$ above it. Each "
            r"of these is $\Delta\tau_{i-1}^*$ plus a vector that all $J_p \bar M^{-1}$ map to zero. The "
            "space of these vectors has the dimension",
            r"\dim = n - \operatorname{rank} \operatorname{col}(J_1, \ldots, J_{i-1})",
            _dimension,
        ),
        Line(
            r"A posture has $J = I$. For the levels below it, (33) reads $\bar M^{-1} \Delta\tau_p^* = \bar "
            r"M^{-1} \Delta\tau_i$, and these levels have no choice:",
            r"\Delta\tau_i = \Delta\tau_p^*",
            _all_taken,
        ),
        Line(
            "The order of the levels has no other effect. In particular, if no task has an error ($e_i = 0$ "
            "for all $i$), every order gives the same result, an unchanged torque:",
            r"e_1 = e_2 = e_3 = 0 \quad\Rightarrow\quad \Delta\tau^* = 0 \text{ in every order}",
            _at_rest,
        ),
    ),
    questions=(
        Question(
            "An arm has seven joints and three levels: position (3 coordinates), orientation (3), posture "
            "(7). How many free motions does each level have in the order of the lesson? How many does each "
            "level have with the posture in the middle, and with the posture first?",
            "In the order of the lesson, the levels have 7, 4 and 1 free motions. With the posture in the "
            "middle, they have 7, 4 and none: the posture uses all four. With the posture first, they have "
            "7, none and none.",
        ),
        Question(
            "The shoulder is 25° and the elbow 20° from the target of the posture. Why does the lesson "
            "state an error of 32°?",
            r"The error of a level is the length of its vector: $\sqrt{25^2 + 20^2} = ⟨norm⟩$.",
            {"norm": (math.hypot(25, 20), ".1f")},
        ),
        Question(
            "With the posture first, the hand does not reach its target. Compute its distance from the "
            "target from the two postures alone, and compare the distance with the measurement of the "
            "lesson.",
            "By the forward kinematics, the positions of the hand in the two postures are ⟨apart⟩ mm apart. "
            "The run ends at ⟨seen⟩ mm. The distance does not depend on the controller: if the posture is "
            "reached, the tasks below it have no effect.",
            {"apart": (_between_hands(), ".0f"), "seen": (GONE, ".0f")},
        ),
    ),
)
