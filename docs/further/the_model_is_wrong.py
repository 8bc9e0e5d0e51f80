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
            r"The arm obeys $M \ddot q + N + \tau_d = \tau$, but the model (19) is $M_n \ddot q + N_n = "
            r"\tau$. With $\tilde M = M - M_n$ and $\tilde N = N - N_n$ the error of the predicted "
            "acceleration is (21)",
            r"\gamma = M_n^{-1} \left( \tilde M \ddot q + \tilde N + \tau_d \right)",
            _nominal,
        ),
        Line(
            "In the coordinates of the task this error is (24)",
            r"\beta = J M_n^{-1} \left( \tilde M \ddot q + \tilde N + \tau_d \right)",
            _task,
        ),
        Line(
            r"If the controller relies on the model, the task obeys $\ddot{\tilde x} + K_V \dot{\tilde x} + "
            r"K_P \tilde x = -\beta$, up to the sign of $\tilde x$. With a constant $\beta$ the task comes "
            "to rest at a distance from its target:",
            r"|\tilde x| \to |\beta| / K_P",
            _at_rest,
            1e-6,
        ),
        Line(
            "The error of time-delay estimation is (25), where the index 0 means one millisecond ago. All "
            "terms that have not changed in this millisecond cancel, including friction and loads:",
            r"\delta = \bar M^{-1} \left[ (M - \bar M)\ddot q - (M_0 - \bar M)\ddot q_0 + n - n_0 \right]",
            _delayed,
        ),
    ),
    questions=(
        Question(
            "A joint has $M_n = 0.05$ kg·m² and 0.1 N·m of dry friction, which the model does not contain. "
            "How far from its target may the joint stop with $K_P = 200$ 1/s², and how far with $K_P = 50$ "
            "1/s²?",
            r"$\beta = 0.1/0.05 = ⟨beta⟩$ rad/s², so the joint may stop up to $\beta/K_P$ from its target: "
            "⟨stiff⟩° and ⟨soft⟩°. At rest, friction takes any value up to 0.1 N·m: the joint stops "
            "somewhere within this distance.",
            {
                "beta": (0.1 / 0.05, ".0f"),
                "stiff": (math.degrees(0.1 / 0.05 / 200), ".2f"),
                "soft": (math.degrees(0.1 / 0.05 / 50), ".1f"),
            },
        ),
        Question(
            "An arm moves in the horizontal plane. The masses of its model are 20 % too small (0.2), and "
            "all else in the model is exact. How large is the error of the predicted acceleration? How "
            "large is it at rest?",
            r"With $M_n = M - 0.2\,M$ the error is $\gamma = M_n^{-1} (0.2\,M)\,\ddot q = ⟨share⟩\,\ddot "
            "q$, a quarter of the acceleration. At rest the acceleration is zero, so the error vanishes: "
            "without gravity, wrong masses matter only while the arm accelerates. That is why most of OSF's "
            "error in *As identified* is due to friction.",
            {"share": (0.2 / 0.8, ".2f")},
        ),
        Question(
            "Dry friction of 0.05 N·m changes its sign when a joint with $M = 0.1$ kg·m² reverses its "
            r"motion. Time-delay estimation uses $\bar M = 0.033$ kg·m². How large is the error of the "
            "acceleration immediately after the change, and 10 ms later?",
            "The friction jumps by twice 0.05 N·m, which gives an error of ⟨jump⟩ rad/s². Each step leaves "
            r"the share $1 - \bar M/M$, that is, ⟨left⟩. After ten steps the error is ⟨later⟩ rad/s². A "
            "force that does not change leaves no error.",
            {
                "jump": (2 * 0.05 / 0.1, ".0f"),
                "left": (LEFT, ".2f"),
                "later": (2 * 0.05 / 0.1 * LEFT**10, ".3f"),
            },
        ),
    ),
)
