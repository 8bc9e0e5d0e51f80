"""The model is wrong: errors of a nominal model (21), (24), and of time-delay estimation (25)."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import Further, Line, Question, inertia

LEFT = 1 - 0.033 / 0.1


def _nominal(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_n = inertia(rng, 3), inertia(rng, 3)
    N, N_n, disturbance, tau = rng.normal(size=(4, 3))
    a = np.linalg.solve(M, tau - N - disturbance)
    expected = np.linalg.solve(M_n, tau - N_n)
    return expected - a, np.linalg.solve(M_n, (M - M_n) @ a + (N - N_n) + disturbance)


def _task(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J, M, M_n = rng.normal(size=(2, 3)), inertia(rng, 3), inertia(rng, 3)
    N, N_n, disturbance, tau = rng.normal(size=(4, 3))
    a = np.linalg.solve(M, tau - N - disturbance)
    expected = np.linalg.solve(M_n, tau - N_n)
    return J @ expected - J @ a, J @ np.linalg.solve(M_n, (M - M_n) @ a + (N - N_n) + disturbance)


def _at_rest(rng: np.random.Generator) -> tuple[float, float]:
    K_p, beta = rng.uniform(50, 200), rng.normal()
    K_v, x, v, h = 2 * math.sqrt(K_p), 0.0, 0.0, 1e-3
    for _ in range(20_000):
        v += h * (beta - K_v * v - K_p * x)
        x += h * v
    return x, beta / K_p


def _delayed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M_bar = np.diag(rng.uniform(0.5, 2, 3))
    M, M_0 = inertia(rng, 3), inertia(rng, 3)
    n, n_0, a, a_0 = rng.normal(size=(4, 3))
    H, H_0 = (M - M_bar) @ a + n, (M_0 - M_bar) @ a_0 + n_0
    tau = M_bar @ a + H
    predicted = np.linalg.solve(M_bar, tau - H_0)
    return predicted - a, np.linalg.solve(M_bar, (M - M_bar) @ a - (M_0 - M_bar) @ a_0 + n - n_0)


FURTHER = Further(
    derivation=(
        Line(
            r"The arm obeys $M \ddot q + N + \tau_d = \tau$; the model (19) says $M_n \ddot q + N_n = "
            r"\tau$. With $\tilde M = M - M_n$ and $\tilde N = N - N_n$ the acceleration it predicts is "
            r"wrong by (21)",
            r"\gamma = M_n^{-1} \left( \tilde M \ddot q + \tilde N + \tau_d \right)",
            _nominal,
        ),
        Line(
            "and in the task's coordinates by (24)",
            r"\beta = J M_n^{-1} \left( \tilde M \ddot q + \tilde N + \tau_d \right)",
            _task,
        ),
        Line(
            r"A controller that relies on the model gets $\ddot{\tilde x} + K_V \dot{\tilde x} + K_P \tilde "
            r"x = -\beta$, up to the sign of $\tilde x$. With a constant $\beta$ the task comes to rest off "
            r"its target:",
            r"|\tilde x| \to |\beta| / K_P",
            _at_rest,
            1e-6,
        ),
        Line(
            "The error of time-delay estimation is (25), where the index 0 means one millisecond ago. Here "
            "all terms that have not changed in this millisecond cancel, friction and loads included:",
            r"\delta = \bar M^{-1} \left[ (M - \bar M)\ddot q - (M_0 - \bar M)\ddot q_0 + n - n_0 \right]",
            _delayed,
        ),
    ),
    questions=(
        Question(
            "A joint with $M_n = 0.05$ kg·m² and 0.1 N·m of dry friction that the model does not know; "
            "$K_P = 200$ 1/s². How far from its target may it stop? And with $K_P = 50$?",
            r"$\beta = 0.1/0.05 = ⟨beta⟩$ rad/s², so up to $\beta/K_P$: ⟨stiff⟩° and ⟨soft⟩°. At rest, "
            r"friction takes any value up to 0.1 N·m: the joint stops somewhere within this range.",
            {
                "beta": (0.1 / 0.05, ".0f"),
                "stiff": (math.degrees(0.1 / 0.05 / 200), ".2f"),
                "soft": (math.degrees(0.1 / 0.05 / 50), ".1f"),
            },
        ),
        Question(
            "A model that is 20 % too light (0.2) and right in everything else, on an arm in the horizontal "
            "plane. How wrong is the acceleration it predicts? How large is the error at rest?",
            r"With $M_n = M - 0.2\,M$ it is $\gamma = M_n^{-1} (0.2\,M)\,\ddot q = ⟨share⟩\,\ddot q$: a "
            r"quarter of the acceleration. At rest "
            "there is none, so the error vanishes: without gravity, wrong masses matter only while the "
            "arm accelerates. That is why most of OSF's error in *As identified* is friction's.",
            {"share": (0.2 / 0.8, ".2f")},
        ),
        Question(
            r"Dry friction of 0.05 N·m changes its sign when a joint with $M = 0.1$ kg·m² reverses its "
            r"motion. How large is the error of acceleration under time-delay estimation with $\bar M = "
            r"0.033$ kg·m² at once, and 10 ms later?",
            r"The force jumps by twice 0.05 N·m: ⟨jump⟩ rad/s². Each step leaves $1 - \bar M/M$, ⟨left⟩; "
            r"after ten ⟨later⟩ rad/s². "
            "A force that does not change leaves no error.",
            {
                "jump": (2 * 0.05 / 0.1, ".0f"),
                "left": (LEFT, ".2f"),
                "later": (2 * 0.05 / 0.1 * LEFT**10, ".3f"),
            },
        ),
    ),
)
