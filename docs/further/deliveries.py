"""Deliveries: the time that a window of two tasks saves, and the point where the base waits."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, measured

RATIO = measured("deliveries", "The round takes at most 0.7 times as long.")
STRICT = measured("deliveries", "Two tasks at a time are still faster")
RADIUS = 1.2
TURN = math.radians(40)


def _serial(rng: np.random.Generator) -> tuple[float, float]:
    drive, reach, wait = rng.uniform(1, 9, 3)
    clock = 0.0
    for _ in range(4):
        for part in (drive, reach, wait):
            clock += part
    return clock, 4 * (drive + reach + wait)


def _overlapped(rng: np.random.Generator) -> tuple[float, float]:
    """Returns both sides for a round as a sequence of events: base and hand start at the same time, and the
    next delivery begins when both have finished."""
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
            "One task at a time, a round to $m$ people takes the sum of everything: driving $t_b$, "
            "reaching $t_h$, waiting $t_w$,",
            r"T_1 = m\,(t_b + t_h + t_w)",
            _serial,
        ),
        Line(
            "With a window of two, driving and reaching go on together. The time is then the longer of the "
            "two plus the wait:",
            r"T_2 = m\,(\max(t_b, t_h) + t_w)",
            _overlapped,
        ),
        Line(
            r"While the hand waits at $p$, the base may be anywhere within $\rho$ of it. For a goal $g$ "
            r"beyond that, (12) leaves "
            "as the best place",
            r"p + \rho\, \frac{g - p}{\lVert g - p \rVert}",
            _edge,
            1e-5,
        ),
        Line(
            r"If the goal moves, this place moves along the edge of that circle. If the direction to the "
            r"goal turns by $\varphi$, the base drives",
            r"s = \rho\, \varphi",
            _along,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "One round takes 31 s with one task at a time. How long does it take with two, by the ratio that "
            "the first step measures, and how long if both must stop at every place (second step, 41 s)? "
            "What factors are these? The paper has one over four rounds.",
            "The ratios are ⟨ratio⟩ and ⟨strict⟩, so ⟨time⟩ and ⟨strict_time⟩ s: factors of ⟨factor⟩ and "
            "⟨strict_factor⟩. The paper has 2.3, compared with a robot whose base and arm take turns; the "
            "paper does not print its rule.",
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
            "By the two first lines, how large can the factor $T_1/T_2$ be if nobody waits ($t_w = 0$)? A "
            "report claims a larger factor. What would you ask its authors?",
            r"$(t_b + t_h)/\max(t_b, t_h)$ is at most 2, where both take equally long. The lines assume "
            r"that $t_b$ and $t_h$ are the same in both runs. So ask whether they were the same: if the "
            r"base may pass far from its place in one run and has to go all the way to it in the other, the "
            r"two runs have different $t_b$.",
        ),
        Question(
            "The base waits at the edge, $\\rho = 1.2$ m from the point below the hand, and the next "
            "person moves so that the direction to them turns by 40°. How far does the base drive while "
            "the hand stays?",
            r"$\rho\,\varphi = ⟨way⟩$ m. This way is not lost: it is the part of the new way that the base "
            r"can drive before the ball is taken.",
            {"way": (RADIUS * TURN, ".2f")},
        ),
    ),
)
