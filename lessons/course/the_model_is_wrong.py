"""The model is wrong

If you had the exact model of an arm, would you use it?

Minutes: 10
You need: lesson "no-model-needed"
"""

from __future__ import annotations

from lessons.teaching.claim import Claim
from lessons.teaching.control import Control
from lessons.teaching.lesson import Ghost, Lesson, Step, card_of
from lessons.teaching.measure import Measure, Signal
from lessons.teaching.prediction import Choice, Option, Value

HAND = Signal("error/position", "mm")
Q1 = Signal("error/q1", "deg")
CONTROLLER = Control("controller", "Controller", choices=("himpc", "osf", "hqp"))
FRICTION = Control("plant.friction", "Friction of the joints, N·m", 0.0, 0.3)
MASS = Control("plant.mass_scale", "Mass of the links, factor", 0.5, 2.0)
# The true parameters of this scene's plant, for the controller's nominal model.
EXACT = (
    "nominal.mass_scale=1",
    "nominal.inertia_scale=1",
    "nominal.armature=[0.05,0.05,0.03]",
    "nominal.damping=[0.15,0.1,0.08]",
)

EXACTLY = Step(
    title="An exact model",
    text=r"""
    OSF computes its torque from a model, $\tau = M_n \ddot q_{ref} + N_n$. Here the model has the exact
    masses, inertias and viscous friction, and the arm has no dry friction. The model (19) is equal to the
    arm. The ghost is HIMPC, which has no model and uses the measurements of a millisecond ago.
    """,
    do="Add a little dry friction.",
    why=r"""
    With a perfect model the error is far smaller than HIMPC's: the model predicts the dynamics, whereas
    time-delay estimation measures them afterwards. The question is how long such a model stays perfect.
    """,
    prediction=Choice(
        "OSF has the exact model and HIMPC has no model. OSF's error is …",
        (
            Option("much smaller than HIMPC's", high=0.2),
            Option("about the same", 0.5, 2.0),
            Option("larger", low=2.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=1,
    ),
    claims=(
        Claim(
            "With the exact model OSF's largest error is less than a tenth of HIMPC's.",
            Measure(HAND, over_ghost=True),
            "at most",
            0.1,
            fails_with=("plant.friction=0.05",),
            because="with this dry friction the error is no longer below a tenth of HIMPC's",
        ),
    ),
    set=("controller=osf", "plant.friction=0", *EXACT),
    duration=1.5,
    ghost=Ghost("himpc: no model", ("controller=himpc",)),
    controls=(FRICTION, MASS, CONTROLLER),
    plots=(HAND, Q1),
)

REALITY = Step(
    title="As identified",
    text=r"""
    Now the model is as inexact as in a laboratory: all its masses and inertias are 20 % too light, and it
    contains no friction. The error of the model, (24), acts like a disturbance all the time:

    $$\beta = J M_n^{-1} ( \tilde M \ddot q + \tilde N + \tau_d )$$
    """,
    do="Remove the friction, then correct the masses. Which of the two errors was larger?",
    why=r"""
    The springs of (4) must compensate for the forces that the model does not explain; here these are mostly
    friction. HIMPC needs no model of friction: it measures the effect of the torque of a millisecond ago.
    """,
    prediction=Value(
        "The model is 20 % too light and has no friction: how many times larger is OSF's error than HIMPC's?",
        Measure(HAND, over_ghost=True),
        low=0.1,
        high=1000.0,
        factor=2.0,
    ),
    claims=(
        Claim(
            "The largest error is at least ten times HIMPC's.",
            Measure(HAND, over_ghost=True),
            "at least",
            10.0,
            fails_with=("plant.friction=0", *EXACT),
            because="with the exact model OSF is better than HIMPC",
        ),
    ),
    set=("controller=osf",),
    duration=1.5,
    ghost=Ghost("himpc: no model", ("controller=himpc",)),
    controls=(CONTROLLER, FRICTION, MASS),
    plots=(HAND, Q1),
)

HEAVIER = Step(
    title="Links that are 50 % heavier",
    text=r"""
    The controller is HIMPC, and every link is 50 % heavier than before. The controller has no information
    about this change, and $\bar M$ stays the same. Table V of the paper disturbs the inertias by ±20 % and
    finds that level 1 changes by about 2 % at most. The ghost has the old links.
    """,
    do=(
        "Set half the mass: how do error and gauge change? Then reset the mass, raise M̄, and remove friction."
    ),
    why=r"""
    The error grows a little. Heavier links make $M^{-1}\bar M$ smaller, so corrections are slower. The part
    of the error that is due to inertia grows by half, as the mass does. To see this part alone, remove the
    friction. But three quarters of the error are due to friction, which does not grow with the mass. A
    larger $\bar M$ makes the whole error as small as before. Lighter links make corrections faster and the
    error smaller. They do not lead to instability, since the inertia of the motors is left: with links of a
    twentieth of the mass the gauge reads 0.47. The gauge passes 1 only if the motors are lighter, too, with
    0.01 kg·m² each. As long as $\lVert I - M^{-1}\bar M \rVert$ is below 1, errors stay bounded (Remark 4).
    This condition is sufficient, not necessary: in the long run the spectral radius decides, which the
    gauge shows.
    """,
    prediction=Choice(
        "The links are 50 % heavier, and HIMPC does not know it. HIMPC's largest error grows …",
        (
            Option("by half, as the mass does", 1.35, 1.65),
            Option("by less than a quarter", high=1.25),
            Option("to more than twice", low=2.0),
        ),
        Measure(HAND, over_ghost=True),
        tempting=0,
    ),
    claims=(
        Claim(
            "The largest error grows by less than 25 %.",
            Measure(HAND, over_ghost=True),
            "at most",
            1.25,
            fails_with=("M_bar_scale=0.5",),
            because="half the M̄ corrects half as fast",
        ),
        Claim(
            "The spectral radius is below 1, without any retuning.",
            Measure(Signal("gauge_radius")),
            "at most",
            1.0,
            fails_with=("M_bar_scale=4",),
            because="with links of this weight the loop is unstable with such a large M̄",
        ),
        Claim(
            "The hand stays within 0.3 mm.",
            Measure(HAND),
            "at most",
            0.3,
            fails_with=("controller=hqp",),
            because="HQP's model has no friction",
        ),
    ),
    set=("plant.mass_scale=1.5", "plant.inertia_scale=1.5"),
    duration=1.5,
    ghost=Ghost("the old links", ("plant.mass_scale=1", "plant.inertia_scale=1")),
    controls=(MASS, Control("M_bar_scale", "M̄, factor", 0.5, 4.0, log=True), CONTROLLER, FRICTION),
    plots=(HAND, Signal("gauge_radius")),
)

LESSON = Lesson(
    name="the-model-is-wrong",
    card=card_of(__doc__),
    scene="planar3-circle",
    steps=(EXACTLY, REALITY, HEAVIER),
)
