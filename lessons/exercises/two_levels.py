"""Two levels

The second task must not change the result of the first: how does a QP guarantee this?

Minutes: 40
You need: exercise "one-level-qp"; lesson "inside-the-qp"
"""

from __future__ import annotations

from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import held, hierarchy
from lessons.exercises.mistakes import Mistake, wrong
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

# This M̄ is not a multiple of the identity matrix, so that a solution without M̄ gives a wrong result.
SETTINGS = ("horizon=1", "damping=false", "M_bar=[0.06,0.03,0.02]", "T_s=0.002", "q1_amplitude_deg=60")
FREE = RunSpec("planar3-circle", set=SETTINGS, duration=1.0)
WEAK = RunSpec("planar3-circle", set=(*SETTINGS, "limits.torque_scale=0.04"), duration=1.0)
FIGHT = RunSpec("planar3-conflict", set=SETTINGS[:-1], duration=1.5)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    return (
        GradeCheck(
            "Without active bounds the torque is the optimum of both levels.",
            "a residual, a weight or a level is wrong",
            pushed(with_gains(FREE, seed, "position", "q1"), seed, "link_3", 2.0, plane=True),
            1e-6,
            beside="hiqp",
            points=2,
        ),
        GradeCheck(
            "Nothing leaks from level 2 to level 1.",
            "the equality (33) is not satisfied: J₁M̄⁻¹Δτ₂ = J₁M̄⁻¹Δτ₁. Return one row per level",
            WEAK,
            1e-7,
            measure=Measure(Signal("priority_leak", "m/s²")),
            points=3,
        ),
        GradeCheck(
            "If the torque is not enough for both levels, the error of level 2 grows.",
            "the torque is not the optimum: the bounds must be constraints in the QPs of both levels",
            with_gains(WEAK, seed + 1, "position", "q1", K_p=200.0),
            1e-6,
            beside="hiqp",
            points=3,
        ),
        GradeCheck(
            "If the tasks conflict, the hand stays on its circle.",
            "the error of level 1 grows in favour of level 2",
            FIGHT,
            1.0,
            measure=Measure(Signal("error/position", "mm"), "rms", after=0.5),
            points=2,
        ),
    )


MISTAKES: tuple[Mistake, ...] = (
    wrong("the torque is constant: no cost is minimised", held),
    wrong("no bound is in the QP", hierarchy, limits="none"),
    wrong("the equality (33) is missing: a weighted sum is not strict", hierarchy, equality="none"),
    wrong("the equality (33) has J₁ instead of J₁M̄⁻¹", hierarchy, equality="without M̄"),
    wrong("J₁M̄⁻¹Δτ₂ is set to zero: it must be equal to J₁M̄⁻¹Δτ₁", hierarchy, equality="zero"),
    wrong("the levels are in reverse order: level 1 has the highest priority", hierarchy, order=-1),
    wrong(
        "the levels are in reverse order: level 1 has the highest priority",
        hierarchy,
        order=-1,
        equality="about the first",
    ),
    wrong("the second level is left out", hierarchy, levels=1),
    wrong("f has the wrong sign: f = GᵀQe⁰", hierarchy, f=-1.0),
    wrong("R is missing: it weighs the increments, and is a part of H", hierarchy, R=False),
    wrong("Q is missing in f = GᵀQe⁰", hierarchy, Q=False),
    wrong(
        "the desired values are those of this tick: (28) needs the values of the next knot, index 1",
        hierarchy,
        ahead=0,
    ),
    wrong("M̄ is missing in G = (1 + K_v T_s) J M̄⁻¹", hierarchy, M_bar=False),
    wrong("τ₀ is missing: the QP gives increments", hierarchy, alone=True),
    wrong("the velocity bound (32e) is missing", hierarchy, limits="torque"),
    wrong("the bound (32f) is on Δτ instead of τ₀ + Δτ", hierarchy, limits="on the increment"),
    wrong(
        "one period uses the whole distance to the velocity bound: `approach` is not used",
        hierarchy,
        limits="at once",
    ),
)


EXERCISE = Exercise(
    name="two-levels",
    card=card_of(__doc__),
    equation=r"\min_{\Delta\tau_2} \lVert e_2 \rVert_Q^2 + \lVert \Delta\tau_2 \rVert_R^2 "
    r"\quad \text{s.t. bounds, } J_1 \bar M^{-1} \Delta\tau_2 = J_1 \bar M^{-1} \Delta\tau_1",
    plain="min ‖e₂‖²_Q + ‖Δτ₂‖²_R, within bounds and with J₁M̄⁻¹Δτ₂ = J₁M̄⁻¹Δτ₁",
    hints=(
        "Solve level 1 as before. Level 2 is the same QP with rows that keep J₁M̄⁻¹Δτ as in level 1.",
        "In `solve_qp` a row with lower = upper is an equality.",
        "Near singularities this is safer: Δτ₂ = Δτ₁ + Z y, with Z a basis of the null space of J₁M̄⁻¹ (SVD).",
        "Return np.array([now.tau_0 + dtau_1, now.tau_0 + dtau_2]): one row per level; the last row acts.",
    ),
    lesson="inside-the-qp",
    checks=checks,
    mistakes=MISTAKES,
)
