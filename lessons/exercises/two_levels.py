"""Two levels

The second wish must not cost the first anything: how does a QP know?

Minutes: 40
You need: exercise "one-level-qp"; lesson "inside-the-qp"
"""

from __future__ import annotations

from lessons.exercises.exercise import Check, Exercise, pushed
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

SETTINGS = ("horizon=1", "damping=false", "q1_amplitude_deg=60")
FREE = RunSpec("planar3-circle", set=SETTINGS, duration=1.0)
WEAK = RunSpec("planar3-circle", set=(*SETTINGS, "limits.torque_scale=0.04"), duration=1.0)
FIGHT = RunSpec("planar3-conflict", set=SETTINGS[:2], duration=1.5)


def checks(seed: int) -> tuple[Check, ...]:
    return (
        Check(
            "With room to spare the torque is the optimum of both levels.",
            "a residual or a sign, as in the exercise before, or the second level is left out",
            pushed(FREE, seed, "link_3", 2.0, plane=True),
            1e-6,
            beside="hiqp",
            points=2,
        ),
        Check(
            "Nothing leaks from level 2 to level 1.",
            "the equality (33): J₁M̄⁻¹Δτ₂ = J₁M̄⁻¹Δτ₁; a weighted sum is not strict. Return a row per level",
            WEAK,
            1e-7,
            measure=Measure(Signal("priority_leak", "m/s²")),
            points=3,
        ),
        Check(
            "Where torque is short, level 2 gives way.",
            "the bounds must stand in the QP of both levels",
            WEAK,
            1e-6,
            beside="hiqp",
            points=3,
        ),
        Check(
            "Where the tasks fight, the hand stays on its circle.",
            "level 1 pays for level 2",
            FIGHT,
            1.0,
            measure=Measure(Signal("error/position", "mm"), "rms", after=0.5),
            points=2,
        ),
    )


EXERCISE = Exercise(
    name="two-levels",
    card=card_of(__doc__),
    equation=r"\min_{\Delta\tau_2} \lVert e_2 \rVert_Q^2 + \lVert \Delta\tau_2 \rVert_R^2 "
    r"\quad \text{s.t. bounds, } J_1 \bar M^{-1} \Delta\tau_2 = J_1 \bar M^{-1} \Delta\tau_1",
    hints=(
        "Solve level 1 as before. Level 2 is the same QP with rows that say: J₁M̄⁻¹ stays as it is.",
        "In `solve_qp` a row with lower = upper is an equality.",
        "Safer near singularities: Δτ₂ = Δτ₁ + Z y with Z a basis of what J₁M̄⁻¹ maps to zero (SVD).",
        "Return np.array([now.tau_0 + dtau_1, now.tau_0 + dtau_2]): a row per level, the last one acts.",
    ),
    lesson="inside-the-qp",
    checks=checks,
)
