"""Every number in the texts of the steps that a run gives; see `quoted`."""

from __future__ import annotations

import math

from quoted import Quoted

from lessons.teaching.measure import Measure, Signal, Statistic

HAND = Signal("error/position", "mm")
TILT = Signal("error/orientation", "deg")
EE = Signal("error/ee", "mm")
BASE = Signal("error/base", "m")
WAY = Signal("way of the base", "m")
TORQUE = Signal("torque share", "%")
RADIUS, NORM = Signal("gauge_radius"), Signal("gauge_norm")
ROUGH = Signal("delta_tau", "N·m")
Q1 = Signal("error/q1", "deg")
FORCE = Signal("contact_force", "N")
SPEED_3 = Signal("v", "deg/s", column=2)


def _of(
    signal: Signal, statistic: Statistic = "largest", after: float = 0.0, until: float = math.inf
) -> Measure:
    return Measure(signal, statistic, after, until)


def _ratio(signal: Signal, statistic: Statistic = "largest", after: float = 0.0) -> Measure:
    return Measure(signal, statistic, after, over_ghost=True)


QUOTED = (
    Quoted("a-redundant-arm/1", "turns by almost 30°", _of(Signal("q", "deg", column=2), "range"), 28, 30),
    Quoted(
        "one-task/0",
        "Half a second later the hand is back on its target, and it has not swung",
        _of(HAND, after=0.8),
        0.0,
        0.5,
    ),
    Quoted(
        "one-task/3",
        "It reverses only 0.75 s after the push",
        _of(Signal("v", "deg/s", column=1), "mean", 1.04, 1.06),
        -5,
        5,
        ("limits.velocity=false",),
    ),
    Quoted("one-task/2", "Almost nothing happens", _ratio(HAND), 0.98, 1.05),
    Quoted("no-model-needed/0", "dips by a few millimetres", _of(HAND), 1.5, 5.0),
    Quoted("no-model-needed/0", "to a hundredth of a millimetre", _of(HAND, "last"), 0.0, 0.015),
    Quoted("no-model-needed/0", "it sags by centimetres", _of(HAND, "last"), 15, 100, None),
    Quoted("no-model-needed/2", "0.41 of the error is left", _ratio(HAND), 0.405, 0.415, ("M_bar_scale=2",)),
    Quoted("no-model-needed/2", "The error is less than a fifth", _ratio(HAND), 0.16, 0.2),
    Quoted("no-model-needed/2", "the largest of them is 0.94", _of(RADIUS, "mean"), 0.935, 0.945),
    Quoted("no-model-needed/2", "with the old M̄ the norm is 0.999", _of(NORM, "mean"), 0.9985, 0.9995, None),
    Quoted("no-model-needed/3", "At × 6 the gauge read 0.91", _of(RADIUS, "mean"), 0.905, 0.915, None),
    Quoted("no-model-needed/3", "−1.21 at × 7", _of(RADIUS, "mean"), 1.205, 1.215, ("M_bar_scale=7",)),
    Quoted("no-model-needed/3", "the error grows by half", _of(RADIUS, "mean"), 1.4, 1.6),
    Quoted("two-tasks/1", "by a quarter of a metre", _of(HAND), 225, 275),
    Quoted("two-tasks/2", "keeps its circle to a millimetre", _of(HAND), 0.2, 1.25),
    Quoted("two-tasks/3", "by 0.02° with $Q_2 = 1$", _of(Q1), 0.015, 0.025, ("q1_amplitude_deg=20",)),
    Quoted(
        "two-tasks/3",
        "by 0.05° with 0.01",
        _of(Q1),
        0.045,
        0.055,
        ("q1_amplitude_deg=20", "levels.q1.Q=0.01"),
    ),
    Quoted(
        "two-tasks/3", "by 13° of its 20°", _of(Q1), 12.5, 14.5, ("q1_amplitude_deg=20", "levels.q1.Q=1e-5")
    ),
    Quoted("two-tasks/3", "still several times that of a strict priority", _ratio(HAND), 3, 20),
    Quoted(
        "swap-the-priorities/0",
        "the posture's error of 32°",
        _of(Signal("error/posture", "deg"), "last"),
        31.5,
        32.5,
    ),
    Quoted(
        "swap-the-priorities/1",
        "to a hundredth of a degree",
        _of(Signal("error/posture", "deg"), "last"),
        0,
        0.015,
    ),
    Quoted(
        "when-tasks-fight/0",
        "From 1.3 s on links 2 and 3 come into line",
        _of(Signal("q", "deg", column=2), after=1.2, until=1.3),
        10,
        60,
    ),
    Quoted("when-tasks-fight/0", "passes a thousand times the limit", _of(TORQUE), 1e5, math.inf),
    Quoted("when-tasks-fight/2", "to and fro with 94°/s", _of(SPEED_3, after=2.0), 93.5, 94.5),
    Quoted(
        "stretched-out/0",
        "as much as the motion needs, less than half of the limit",
        _of(TORQUE),
        30,
        50,
        ("controller=himpc",),
    ),
    Quoted(
        "stretched-out/1",
        "after a few tenths of a second the hand is on its circle",
        _of(HAND, after=0.6),
        0,
        0.5,
    ),
    Quoted("stretched-out/2", "an error of some millimetres right at the start", _of(HAND), 2, 10, None),
    Quoted("torque-has-a-limit/0", "nine tenths of the 0.24 N·m", _of(TORQUE), 85, 92),
    Quoted("torque-has-a-limit/1", "falls behind by half a degree", _of(Q1), 0.45, 0.6),
    Quoted(
        "stopping-takes-distance/0",
        "the joint arrives at 57°/s",
        _of(Signal("v", "deg/s", column=1)),
        56.5,
        57.5,
    ),
    Quoted(
        "stopping-takes-distance/2",
        "The joint turns with 18°/s",
        _of(Signal("speed within 5° of an end", "deg/s")),
        17.5,
        18.5,
    ),
    Quoted(
        "stopping-takes-distance/2",
        "take more than 1.5",
        _of(Signal("deceleration to stop", "rad/s²")),
        1.3,
        1.5,
    ),
    Quoted(
        "stopping-takes-distance/2",
        "a stop takes 16 of the 20 rad/s²",
        _of(Signal("deceleration to stop", "rad/s²")),
        15.5,
        16.5,
        ("limits.velocity_approach=0",),
    ),
    Quoted("how-far-ahead/0", "The error does not change", _ratio(HAND, "rms"), 0.98, 1.02),
    Quoted(
        "how-far-ahead/0",
        "Twice the $\\bar M$ halves the error",
        _ratio(HAND, "rms"),
        0.45,
        0.55,
        ("M_bar_scale=2",),
    ),
    Quoted("how-far-ahead/1", "about half the error", _ratio(HAND, "rms"), 0.4, 0.6),
    Quoted("deadlines/0", "The error more than doubles", _ratio(HAND), 2.0, 2.5),
    Quoted("deadlines/1", "The error is the same", _ratio(HAND), 0.95, 1.05),
    Quoted(
        "deadlines/2",
        "To three digits, the late controller now has the same error as the controller in time",
        _ratio(HAND),
        0.995,
        1.005,
    ),
    Quoted("sensors-are-coarse/0", "the motion needs 3 % of the torque limit", _of(TORQUE), 2.5, 3.5, None),
    Quoted("sensors-are-coarse/1", "a quarter of the noise", _ratio(ROUGH, "rms"), 0.22, 0.28),
    Quoted("sensors-are-coarse/1", "grows by little more than half", _ratio(HAND), 1.5, 1.65),
    Quoted("the-model-is-wrong/2", "The error grows a little", _ratio(HAND), 1.02, 1.25),
    Quoted(
        "inside-the-qp/0",
        "level 2 keeps an error of 14 degrees",
        _of(Signal("error/pose", "deg"), "last"),
        13.5,
        14.5,
    ),
    Quoted("inside-the-qp/1", "10 cm off its target", _of(Signal("error/reach", "mm"), after=2.5), 95, 105),
    Quoted(
        "inside-the-qp/2",
        "never more than 1.1 mm off",
        _of(Signal("error/reach", "mm")),
        1.05,
        1.15,
        ("limits.torque_scale=1",),
    ),
    Quoted(
        "inside-the-qp/2",
        "its error is no larger than with the full torque",
        _of(Signal("error/reach", "mm")),
        1.0,
        1.1,
    ),
    Quoted("inside-the-qp/2", "here by a third of the limit", _of(TORQUE), 128, 138, None),
    Quoted(
        "inside-the-qp/3",
        "the wrist is 5 cm from its target",
        _of(Signal("error/reach", "mm"), after=1.95),
        45,
        55,
        None,
    ),
    Quoted(
        "inside-the-qp/3",
        "the joints are off by 7 degrees",
        _of(Signal("error/pose", "deg"), "last"),
        6.5,
        7.5,
        None,
    ),
    Quoted("first-hold-then-reach/0", "off by hundredths of a millimetre", _of(EE), 0.005, 0.1),
    Quoted("first-hold-then-reach/0", "the hand swings out by 12 cm", _of(EE), 115, 125, None),
    Quoted("first-hold-then-reach/1", "1.63 m before its target", _of(BASE, "mean", after=7.0), 1.625, 1.635),
    Quoted(
        "first-hold-then-reach/2",
        "by exactly these 1.63 m",
        _of(Signal("error/ee", "m"), "mean", after=8.5),
        1.625,
        1.635,
    ),
    Quoted(
        "how-strict-is-strict/1", "The error of the hand is less than a tenth of $\\delta$", _of(EE), 0.1, 1.0
    ),
    Quoted(
        "how-strict-is-strict/1",
        "with (11) instead, the hand is off by 3 mm",
        _of(EE),
        2.5,
        3.5,
        ("lexicographic=cost",),
    ),
    Quoted("how-strict-is-strict/1", "35 cm from its target", _of(BASE, "mean", 6.0, 7.0), 0.345, 0.355),
    Quoted(
        "how-strict-is-strict/2",
        "cuts the step to a fortieth",
        _of(Signal("step/base"), "mean"),
        1 / 50,
        1 / 33,
    ),
    *(
        Quoted("how-strict-is-strict/4", phrase, _of(EE), low, high, settings)
        for phrase, low, high, settings in (
            ("off by 2.5 mm instead of 5 mm", 4.9, 5.1, ()),
            ("off by 2.5 mm instead of 5 mm", 2.4, 2.55, ("rate_hz=100",)),
            ("and with two hundred by 1.2 mm", 1.15, 1.25, ("rate_hz=200",)),
            ("a gain of 5 1/s instead of 0.5 1/s the hand is off by 1.2 mm", 1.15, 1.25, ("gains=[5,0.3]",)),
            ("it is off by 5.2 mm", 5.1, 5.25, ("first_level=soft", "levels.ee.Q=1000")),
            ("a hand that is weighed against the base is off by 10 cm", 95, 105, ("first_level=soft",)),
        )
    ),
    Quoted(
        "how-strict-is-strict/4",
        "with a gain of 20 1/s the mean error of the hand is that of the ghost",
        _ratio(EE, "mean"),
        0.9,
        1.1,
        ("gains=[20,0.3]",),
    ),
    Quoted(
        "seeing-ahead/0",
        "more than half a metre of the way back at 8 s",
        _of(WAY, "range", 6.5, 8.0),
        0.5,
        0.7,
    ),
    Quoted("seeing-ahead/0", "about a quarter of the ghost's", _ratio(BASE, "mean", after=8.0), 0.2, 0.3),
    Quoted("seeing-ahead/1", "is off by 3 cm", _of(EE), 25, 35),
    Quoted("seeing-ahead/2", "16 cm from home at the end", _of(BASE, "mean", after=15.9), 0.155, 0.165),
    Quoted("seeing-ahead/2", "the plan keeps the hand within a millimetre", _of(EE), 0.1, 1.0, None),
    Quoted("seeing-ahead/3", "the hand is off by 2 cm", _of(EE), 15, 25),
    Quoted(
        "deliveries/0",
        "less than two thirds of the ghost's time",
        _ratio(Signal("time at work", "s")),
        0.55,
        0.667,
    ),
    Quoted("deliveries/0", "of the ghost's time and distance", _ratio(WAY), 0.55, 0.667),
    Quoted(
        "deliveries/2", "The hand is with the first person by 3 s", _of(EE, after=3.0, until=4.0), 0.0, 10.0
    ),
    Quoted(
        "deliveries/3",
        "a second later the hand is within two centimetres of this goal",
        _of(EE, after=17.5, until=19.5),
        10,
        20,
    ),
    Quoted("deadlines/2", "the limit of stability is still between 2 and 2.5", _of(RADIUS), 0.5, 1.0),
    Quoted(
        "deadlines/2",
        "the limit of stability is still between 2 and 2.5",
        _of(RADIUS),
        1.0,
        9.0,
        ("M_bar_scale=2.5",),
    ),
    Quoted(
        "the-model-is-wrong/1",
        "here these are mostly friction",
        _of(HAND),
        0.0,
        0.5,
        ("plant.friction=0", "plant.damping=0"),
    ),
    Quoted("the-model-is-wrong/1", "here these are mostly friction", _of(HAND), 1.0, 5.0),
    Quoted(
        "inside-the-qp/2",
        "then the error of level 1 grows as well",
        _of(Signal("active/reach")),
        1,
        9,
        ("limits.torque_scale=0.1",),
    ),
    Quoted(
        "how-strict-is-strict/0",
        "more than a third of a step is accepted",
        _of(Signal("step/base"), "mean"),
        0.34,
        0.6,
        None,
    ),
    Quoted(
        "how-strict-is-strict/2",
        "at least a third of a step",
        _of(Signal("step/base"), "mean"),
        0.34,
        0.9,
        None,
    ),
    Quoted("deliveries/2", "three seconds to the second person", _of(Signal("place"), until=17.1), 4, 4),
    Quoted("deliveries/2", "needs nearly seven", _of(Signal("place"), until=21.1), 4, 4, None),
    Quoted("deliveries/2", "needs nearly seven", _of(Signal("place"), until=20.6), 3, 3, None),
    Quoted(
        "swap-the-priorities/2",
        "4.7 N·m in the first",
        _of(Signal("delta_tau", "N·m"), after=2.595, until=2.61),
        4.65,
        4.75,
    ),
    Quoted("your-robot/1", "the head stays too low", _of(HAND, "last"), 10, 100, None),
    Quoted("your-robot/2", "The error is less than half of the ghost's", _ratio(HAND), 0.35, 0.5),
    Quoted(
        "your-robot/2",
        "At three times the suggestion the gauge passes 1",
        _of(RADIUS),
        1.0,
        1.3,
        ("M_bar_scale=3",),
    ),
    Quoted("a-blind-arm/0", "grows by more than 200 N per second", _of(FORCE, "range", 1.7), 100, 130),
    Quoted(
        "a-blind-arm/0", "for one centimetre of error it presses with 4 N", _of(FORCE, "last"), 3.5, 4.5, None
    ),
    Quoted("a-blind-arm/2", "presses with 655 N", _of(FORCE, "mean", 5.0), 650, 660, None),
    Quoted(
        "a-blind-arm/2",
        "the hand moves by less than a millimetre meanwhile",
        _of(Signal("distance from the start", "mm"), "range", 2.0, 5.0),
        0.0,
        1.0,
    ),
    Quoted("a-blind-arm/3", "its motors have nothing to push against", _of(TORQUE), 10, 20),
    Quoted("keeping-clear/1", "15 cm above a target", _of(HAND, "last"), 145, 155),
    Quoted("keeping-clear/2", "orientation is off by 28°", _of(TILT, "last"), 27.5, 28.5),
    Quoted("keeping-clear/3", "it stops 27 cm before its target", _of(HAND, "last"), 265, 275),
)
