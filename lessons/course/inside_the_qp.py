"""Inside the QP

One millisecond taken apart: what exactly is solved, and who feels which bound?

Minutes: 12
You need: lesson "torque-has-a-limit"; what a Lagrange multiplier is
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
TORQUE = Signal("torque share", "%")
RESIDUAL_1, RESIDUAL_2 = Signal("kkt/position"), Signal("kkt/q1")
ACTIVE_1, ACTIVE_2 = Signal("active/position"), Signal("active/q1")
SCALE = Control("limits.torque_scale", "Torque limit, factor", 0.01, 1.0, log=True)
# What the plant of this scene really is, told to the controller.
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)
TIGHT = ("q1_amplitude_deg=60", "limits.torque_scale=0.04")

ONE_TICK = Step(
    title="One tick",
    text=r"""
    Three joints, $N = 5$ steps: $U$ stacks fifteen torque changes. Each level is a quadratic
    program (35),

    $$\min_U \; U^\top \mathcal{Q}\, U + U^\top \mathcal{L} \quad \text{s.t.} \quad C U + D \le 0,
    \; \mathcal{H}(U) = 0$$

    with bounds on position, speed and torque at every knot, and the equality (33) towards the
    levels above. Step by step with the pause key: one tick, one solution.
    """,
    do="Pause, step tick by tick, and read off the active bounds.",
    why=r"""
    A point is the solution if it satisfies the optimality conditions (KKT): feasible, multipliers
    of the right sign, gradient balanced. This residual is computed afresh for every point that is
    applied, whatever the solver says of itself. With room to spare no bound is active, and the
    solution is that of a linear system.
    """,
    prediction=Choice(
        "Nothing presses on the arm here. How many of the bounds are active, on average, at level 2?",
        (
            Option("none", high=0.01),
            Option("a few", 0.01, 5.0),
            Option("about half of them", low=5.0),
        ),
        Measure(ACTIVE_2, "mean"),
        tempting=1,
    ),
    claims=(
        Claim(
            "Level 2's solutions miss their optimality conditions by less than 10⁻¹⁰.",
            Measure(RESIDUAL_2),
            "at most",
            1e-10,
            fails_with=("route=explicit", "solver=proxqp"),
            because="an iterative solver stops once it is near enough",
        ),
        Claim(
            "No bound is active.",
            Measure(ACTIVE_2),
            "at most",
            0.0,
            fails_with=("limits.torque_scale=0.04",),
            because="then level 2 meets the torque limit",
        ),
    ),
    set=("q1_amplitude_deg=60",),
    duration=1.0,
    controls=(SCALE, Control("horizon", "N", 1, 20)),
    plots=(RESIDUAL_1, RESIDUAL_2, ACTIVE_1, ACTIVE_2),
)

BINDING = Step(
    title="Who feels the bound",
    text=r"""
    Torque is short: 4 % of the limit. An active row has a multiplier $\mu > 0$, the price at which
    a little more of that bound would be bought. A joint can sit at its bound in both levels; what
    differs is the price each of them would pay, and so does the cost (31) that is left.
    """,
    do="In the list of active bounds, compare the multipliers of level 1 and level 2.",
    why=r"""
    Level 1 is served: its cost is practically zero. Level 2 leaves a hundred million times as much
    on the table and would pay a lot for torque. The same row, seen by two levels: to one it is a
    fact, to the other an obstacle.
    """,
    prediction=Value(
        "How many of the bounds at the five knots are active at level 2, on average?",
        Measure(ACTIVE_2, "mean"),
        low=0.1,
        high=60.0,
        factor=1.5,
    ),
    claims=(
        Claim(
            "Level 2 has active bounds most of the time: two or more on average.",
            Measure(ACTIVE_2, "mean"),
            "at least",
            2.0,
            fails_with=("limits.torque_scale=1",),
            because="there is room to spare",
        ),
        Claim(
            "Level 1 is left with a cost below 0.01.",
            Measure(Signal("cost/position")),
            "at most",
            0.01,
            fails_with=("limits.torque_scale=0.02",),
            because="then not even level 1 gets what it needs",
        ),
        Claim(
            "Level 2 is left with a mean cost above 100.",
            Measure(Signal("cost/q1"), "mean"),
            "at least",
            100.0,
            fails_with=("limits.torque_scale=1",),
            because="with enough torque it is served as well",
        ),
    ),
    set=TIGHT,
    duration=1.5,
    controls=(SCALE,),
    plots=(ACTIVE_1, ACTIVE_2, Signal("cost/position"), Signal("cost/q1")),
)

LEAK = Step(
    title="Measure the priority",
    text=r"""
    Strict is a word; here is the number. The leak is what lower levels change about a higher one,
    $\lVert J_p \bar M^{-1} (\Delta\tau_i - \Delta\tau_p) \rVert$, in m/s². By (33) it should be
    zero. The circle again, and the tasks fight for torque.
    """,
    do="Switch to the weighted controller and read the leak meter.",
    why=r"""
    Zero up to rounding, since (33) is a constraint and not a wish. It is zero with respect to $\bar
    M$. With the true $M$ a leak remains, the second meter: the arm is not made the way the
    controller thinks. Time-delay estimation notices that part a millisecond later and corrects it
    over tens of milliseconds: a gauge of 0.89 leaves nine tenths of it after one step, a third after
    ten.
    """,
    prediction=Choice(
        "With the arm's true inertia instead of M̄, the leak of the same torques is …",
        (
            Option("zero as well: priorities are exact", high=1e-9),
            Option("not zero", low=1e-4),
        ),
        Measure(Signal("dynamic_leak", "m/s²")),
        tempting=0,
    ),
    claims=(
        Claim(
            "In the controller's own terms nothing leaks: less than 10⁻⁹ m/s².",
            Measure(Signal("priority_leak", "m/s²")),
            "at most",
            1e-9,
            fails_with=("controller=weighted",),
            because="a sum lets every task pull at every other",
        ),
        Claim(
            "In the arm's terms there is a leak, more than 10⁻³ m/s².",
            Measure(Signal("dynamic_leak", "m/s²")),
            "at least",
            1e-3,
            fails_with=("controller=osf", *EXACT),
            because="OSF with the arm's exact inertia projects with the true M",
        ),
        Claim(
            "Of what leaks, more than 85 % are left a millisecond later.",
            Measure(Signal("gauge_radius"), "mean"),
            "at least",
            0.85,
            fails_with=("M_bar_scale=2",),
            because="twice the M̄ corrects twice as fast",
        ),
    ),
    set=TIGHT,
    duration=1.5,
    controls=(Control("controller", "Controller", choices=("himpc", "weighted")), SCALE),
    plots=(Signal("priority_leak", "m/s²"), Signal("dynamic_leak", "m/s²"), HAND),
)

LESSON = Lesson(
    name="inside-the-qp",
    card=card_of(__doc__),
    scene="planar3-circle",
    steps=(ONE_TICK, BINDING, LEAK),
)
