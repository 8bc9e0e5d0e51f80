"""A blind arm: the effect of a table on time-delay estimation, and the growth of the force."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question, inertia, measured

T_S = 1e-3
K_P = 56.2
ASKED = K_P * 0.01
"""The desired acceleration, m/s², at an error of the hand of one centimetre."""
GROWTH = measured("a-blind-arm", "In the last half second") / 0.5
SPRING = measured("a-blind-arm", "At the end the arm presses", there=True)


def _estimate(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar, J = inertia(rng, 5), np.diag(rng.uniform(0.1, 1.0, 5)), rng.normal(size=(3, 5))
    a, n, f = rng.normal(size=5), rng.normal(size=5), rng.normal(size=3)
    tau = M @ a + n + J.T @ f
    return tau - M_bar @ a, (M - M_bar) @ a + n + J.T @ f


def _increment(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M_bar, J, wanted = np.diag(rng.uniform(0.1, 1.0, 5)), rng.normal(size=(3, 5)), rng.normal(size=3)
    apparent = np.linalg.inv(J @ np.linalg.inv(M_bar) @ J.T)
    return J @ np.linalg.inv(M_bar) @ (J.T @ apparent @ wanted), wanted


def _growth(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M_bar, J, wanted = np.diag(rng.uniform(0.1, 1.0, 5)), rng.normal(size=(3, 5)), rng.normal(size=3)
    apparent = np.linalg.inv(J @ np.linalg.inv(M_bar) @ J.T)
    g, f, ticks = rng.normal(size=5), rng.normal(size=3), 20
    tau = g + J.T @ f
    for _ in range(ticks):
        tau = tau + J.T @ apparent @ wanted
    force = np.linalg.lstsq(J.T, tau - g, rcond=None)[0]
    return force, f + ticks * apparent @ wanted


def _spring(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, J, wanted, g = inertia(rng, 5), rng.normal(size=(3, 5)), rng.normal(size=3), rng.normal(size=5)
    apparent = np.linalg.inv(J @ np.linalg.inv(M) @ J.T)
    tau = g + J.T @ apparent @ wanted
    return np.linalg.lstsq(J.T, tau - g, rcond=None)[0], apparent @ wanted


FURTHER = Further(
    derivation=(
        Line(
            r"The arm obeys $M \ddot q + n = \tau - J^\top f$, where $f$ is the force with which the hand "
            "presses. Time-delay estimation attributes the following torque to the arm's own dynamics:",
            r"\tau_0 - \bar M \ddot q_0 = (M - \bar M)\, \ddot q_0 + n + J^\top f",
            _estimate,
        ),
        Line(
            r"When the hand rests on the table, the desired acceleration is $\ddot x = -K_p \tilde x$. Let "
            r"$\bar\Lambda = (J \bar M^{-1} J^\top)^{-1}$. In free space, the increment $\Delta\tau = "
            r"J^\top \bar\Lambda \ddot x$ would produce this acceleration:",
            r"J \bar M^{-1} (J^\top \bar\Lambda\, \ddot x) = \ddot x",
            _increment,
        ),
        Line(
            "But the table does not move. The increment only increases the force, and the desired "
            "acceleration at the next tick is the same. After $k$ ticks the force is",
            r"f_k = f_0 + k\, \bar\Lambda\, \ddot x",
            _growth,
        ),
        Line(
            r"OSF computes its torque anew from the model at each tick, with $\Lambda = (J M^{-1} "
            r"J^\top)^{-1}$. At rest the hand presses with the force",
            r"f = \Lambda\, \ddot x = -\Lambda K_p \tilde x",
            _spring,
        ),
    ),
    questions=(
        Question(
            r"The hand's $K_p$ is 56.2 1/s². By the third line, which mass $\bar\Lambda$ explains the "
            "growth of the force in the last half second, if the error is one centimetre?",
            "At an error of one centimetre the desired acceleration is ⟨asked⟩ m/s². The force grows by "
            r"⟨rate⟩ N per second, that is, by ⟨tick⟩ N per millisecond. This growth equals $\bar\Lambda\, "
            r"\ddot x$ for a mass of ⟨mass⟩ kg. The mass is small like $\bar M$, but the force grows "
            "without end.",
            {
                "asked": (ASKED, ".2f"),
                "rate": (GROWTH, ".0f"),
                "tick": (GROWTH * T_S, ".2f"),
                "mass": (GROWTH * T_S / ASKED, ".2f"),
            },
        ),
        Question(
            r"The ghost presses with a constant force. By the fourth line, which mass $\Lambda$ of the hand "
            "explains this force at an error of one centimetre?",
            r"With $f = \Lambda\, \ddot x$, ⟨asked⟩ m/s² and ⟨force⟩ N, the mass is ⟨mass⟩ kg.",
            {"asked": (ASKED, ".2f"), "force": (SPRING, ".1f"), "mass": (SPRING / ASKED, ".1f")},
        ),
        Question(
            "By the fourth line, which $K_p$ would make the ghost press with 50 N at one centimetre and at "
            "rest? Would this arm press so?",
            r"$K_p = f / (\Lambda\, |\tilde x|) = ⟨K_p⟩$ 1/s², more than thirteen times the ghost's own "
            r"$K_p$. But the line holds at rest only. With this $K_p$ and $K_v = 2 \sqrt{K_p}$, joints pass "
            "their speed limits after the impact, and the hand comes to rest 5 cm beside its target.",
            {"K_p": (50.0 / (SPRING / ASKED * 0.01), ".0f")},
        ),
    ),
)
