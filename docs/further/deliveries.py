"""Deliveries: the time that a window of two tasks saves, and the point where the base waits."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured

RATIO = measured("deliveries", "The round takes at most 0.7 times as long.")
STRICT = measured("deliveries", "Two tasks at a time are still faster")
RADIUS = 1.865
"""The distance of the base from the point below the hand at the limit of the arm's reach, m."""
HAND, OLD, NEW = np.array([0.0, 2.0]), np.array([-1.75, -0.7]), np.array([-1.2, -0.4])
TURN = math.atan2(*(NEW - HAND)[::-1]) - math.atan2(*(OLD - HAND)[::-1])
DRIVEN = measured("deliveries", "Between 8 s and 14 s the base moves")


def _serial(rng: np.random.Generator) -> tuple[float, float]:
    drive, reach, wait = rng.uniform(1, 9, 3)
    clock = 0.0
    for _ in range(4):
        for part in (drive, reach, wait):
            clock += part
    return clock, 4 * (drive + reach + wait)


def _overlapped(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the duration of a simulated round, and the duration by the formula. Base and hand start at the
    same time, and the next delivery begins when both have finished."""
    drive, reach, wait = rng.uniform(1, 9, 3)
    ready = 0.0
    for _ in range(4):
        base, hand = ready + drive, ready + reach
        ready = max(base, hand) + wait
    return ready, 4 * (max(drive, reach) + wait)


def _edge(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    hand, goal, rho = rng.normal(size=2), rng.normal(size=2) + 6.0, rng.uniform(0.5, 1.5)
    angle = np.linspace(0, 2 * np.pi, 2_000_001)
    ring = hand[:, None] + rho * np.array([np.cos(angle), np.sin(angle)])
    tried = ring[:, np.argmin(np.hypot(*(ring - goal[:, None])))]
    return tried, hand + rho * (goal - hand) / np.linalg.norm(goal - hand)


def _along(rng: np.random.Generator) -> tuple[float, float]:
    rho, turn = rng.uniform(0.5, 1.5), rng.uniform(0.1, 1.0)
    angle = np.linspace(0, turn, 100_001)
    steps = np.diff(rho * np.array([np.cos(angle), np.sin(angle)]), axis=1)
    return float(np.hypot(*steps).sum()), rho * turn


FURTHER = Further(
    derivation=(
        Line(
            "With one task at a time, each delivery takes the sum of the times for driving $t_b$, reaching "
            "$t_h$ and waiting $t_w$. A round to $m$ people takes",
            r"T_1 = m\,(t_b + t_h + t_w)",
            _serial,
        ),
        Line(
            "With a window of two tasks, driving and reaching happen at the same time. Each delivery takes "
            "the longer of these two times plus the waiting time:",
            r"T_2 = m\,(\max(t_b, t_h) + t_w)",
            _overlapped,
        ),
        Line(
            r"While the hand waits at $p$, the base may be anywhere within the distance $\rho$ of $p$. If "
            "the goal $g$ of the base is outside this circle, the best place that (12) allows is",
            r"p + \rho\, \frac{g - p}{\lVert g - p \rVert}",
            _edge,
            1e-5,
        ),
        Line(
            "If the goal moves, this place moves along the edge of the circle. If the direction to the goal "
            r"turns by $\varphi$, the base drives the distance",
            r"s = \rho\, \varphi",
            _along,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "One round takes 31 s with one task at a time. The first step measures the ratio for two tasks "
            "at a time: how long does the round take with two tasks? In the second step base and hand must "
            "stop at every place, and one task at a time takes 41 s. How long does the round take there "
            "with two tasks? By which factors are two tasks faster? Compare with the factor that the paper "
            "reports for four rounds.",
            "The ratios are ⟨ratio⟩ and ⟨strict⟩, so the rounds take ⟨time⟩ and ⟨strict_time⟩ s. The "
            "factors are ⟨factor⟩ and ⟨strict_factor⟩. The paper reports 2.3 in comparison with a robot "
            "whose base and arm move in turn. It does not say when a task of the base is done.",
            {
                "ratio": (RATIO, ".2f"),
                "strict": (STRICT, ".2f"),
                "time": (31 * RATIO, ".0f"),
                "strict_time": (41 * STRICT, ".0f"),
                "factor": (1 / RATIO, ".1f"),
                "strict_factor": (1 / STRICT, ".1f"),
            },
        ),
        Question(
            "By the first two lines, how large can the factor $T_1/T_2$ be without any waiting ($t_w = 0$)? "
            "A report claims a larger factor. What would you ask its authors?",
            r"$(t_b + t_h)/\max(t_b, t_h)$ is at most 2. It is 2 if driving and reaching take equally long. "
            "The lines assume that $t_b$ and $t_h$ are the same in both runs. So ask whether they were the "
            "same in the report. For example, $t_b$ differs if the base may pass its place at a distance in "
            "one run but must reach the place in the other run.",
        ),
        Question(
            r"In the fourth step the hand is above (0, 2) m, and $\rho = 1.865$ m. The place of the base "
            "moves from (−1.75, −0.7) m to (−1.2, −0.4) m. By which angle does the direction from the hand "
            "to the place turn, and how far does a base drive that rests at the edge of the circle?",
            r"The direction turns by ⟨turn⟩°, and the base drives $\rho\,\varphi = ⟨way⟩$ m. In the lesson "
            "it drives ⟨driven⟩ m between 8 s and 14 s: at 8 s it has 5 cm to go to its first point at the "
            "edge. This distance is not wasted: it is the part of the new way that the base can drive before "
            "the ball is taken.",
            {
                "turn": (math.degrees(TURN), ".1f"),
                "way": (RADIUS * TURN, ".2f"),
                "driven": (DRIVEN, ".2f"),
            },
        ),
    ),
)
