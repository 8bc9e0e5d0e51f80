"""Sentences with a reason that no intervention tests, and the tests that check them instead.

A sentence is identified by its place and its beginning. Each entry names the test that checks its sentences,
except for three kinds that cannot be false: a definition, an instruction to the reader, and the purpose of a
part of the program.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["definition", "instruction", "purpose", "mathematics", "measured", "software"]


@dataclass(frozen=True)
class Exempt:
    """Sentences of one kind.

    Attributes:
        kind: "definition", "instruction", "purpose" (of a part of the program: in sources only),
            "mathematics" (it follows from equations), "measured" (a separate test removes the cause), or
            "software" (what the program does).
        held_by: "file::test", the test that checks them; "" for the first three kinds.
        sentences: (place, beginning of the sentence).
    """

    kind: Kind
    held_by: str
    sentences: tuple[tuple[str, str], ...]


LESSONS, FURTHER, HIMPC = (
    "tests/lessons/test_lessons_",
    "tests/test_further.py::test_",
    "tests/himpc/test_himpc_",
)

# fmt: off
TEXTS = (
    # ---------------------------------------- sentences that cannot be false
    Exempt("instruction", "", (
        ("no-model-needed/3", "So start small, go up in small steps"),
        ("further/no-model-needed", "That is why $\\bar M$ is raised in small steps"),
        ("stretched-out/2", "Where an error has two possible causes"),
        ("deadlines/2", "So let $\\bar M$ be twice as large."),
        ("inside-the-qp/1", "It has targets for *two* numbers, so look"),
        ("further/deliveries", "So ask whether they were"),
        ("contributing", "Each sentence that gives a reason needs a run"),
    )),
    Exempt("definition", "", (
        ("disagreements", "So if two numbers differ"),
        ("disagreements", "Here is every row that does not agree"),
        ("lessons/papers/disagreements.py", "So if two numbers differ"),
        ("lessons/papers/disagreements.py", "Here is every row that does not agree"),
    )),
    # ---------------------------------------- consequences of equations
    Exempt("mathematics", FURTHER + "an_equation_holds", (
        ("further/no-model-needed", "If $M$ and $n$ have hardly changed meanwhile"),
        ("further/no-model-needed", "They are real, since $M^{-1} \\bar M$ is similar"),
        ("further/stretched-out", "For any vector $X$ we have"),
        ("further/stretched-out", "Here $R$ weighs a *change* of torque, so the step is repeated"),
        ("further/torque-has-a-limit", "As long as $\\tau_0$ is within its limits"),
        ("further/torque-has-a-limit", "So no level can make the level below infeasible"),
        ("further/how-far-ahead", "Every $\\Delta\\tau$ acts on all later knots"),
        ("further/sensors-are-coarse", "A deadbeat controller computes"),
        ("further/the-model-is-wrong", "At rest the acceleration is zero, so the error vanishes"),
        ("further/how-strict-is-strict", "Then no term of (8) is larger either"),
        ("further/how-strict-is-strict", "This distance must be at most"),
        ("further/how-strict-is-strict", "The derivation says that (12) is the stricter one"),
        ("further/your-robot", "The eigenvalues of $M^{-1} \\bar M$ are those of a symmetric matrix"),
        ("further/your-robot", "The stability limit is 2, so that a real lamp"),
    )),
    Exempt("mathematics", FURTHER + "an_answer_computes_its_numbers", (
        ("further/a-redundant-arm", "The rank is 1, so two motions are free"),
        ("further/no-model-needed", "Along a curve the error is about $M/\\bar M$ times"),
        ("further/when-tasks-fight", "The task asks for $a = 50$ rad/s², so"),
        ("further/how-far-ahead", "A change of acceleration stays in force at all later knots"),
        ("further/deadlines", "$(1 - 0.1 - 0.1)^k = 0.01$ at $k = 21$"),
        ("further/sensors-are-coarse", "Without the gear, ten times the period"),
        ("further/the-model-is-wrong", "$\\beta = 0.1/0.05 = 2$ rad/s²"),
        ("further/inside-the-qp", "$g = (-9.09, -6.06)$, so"),
        ("further/how-strict-is-strict", "It leaves the circle by $\\alpha^2/2$"),
        ("further/deliveries", "The ratios are 0.63 and 0.82, so"),
    )),
    Exempt("mathematics", HIMPC + "prediction.py::test_joint_predictions_equal_the_printed_system", (
        ("no-model-needed/0", "So (13) only contains the *change*"),
    )),
    Exempt("mathematics", LESSONS + (
        "derivations.py::test_with_links_2_and_3_in_line_any_motion_of_joint_1_moves_the_hand"
    ), (
        ("when-tasks-fight/0", "When they are in line, they can no longer compensate for joint 1"),
    )),
    Exempt("mathematics", HIMPC + "cascade.py::test_no_freedom_left_keeps_the_upper_levels", (
        ("when-tasks-fight/2", "If nothing is left for level 2, that problem is still solvable"),
    )),
    Exempt("mathematics", LESSONS + "derivations.py::test_the_first_of_twenty_changes_is_not_alone", (
        ("how-far-ahead/1", "It does not act like $10/20$"),
    )),
    Exempt("mathematics", LESSONS + "derivations.py::test_the_speeds_of_stopping_takes_distance", (
        ("stopping-takes-distance/2", "So $t = T_s + 5/15$ s"),
    )),
    Exempt("mathematics", (
        LESSONS + "derivations.py::test_RT4_asks_joint_1_for_more_than_its_data_sheet_allows"
    ), (
        ("disagreements", "The data sheet's 85°/s for joint 1"),
    )),
    Exempt("mathematics", LESSONS + "geometry.py::test_geometry_and_solver_find_the_same_points", (
        ("inside-the-qp/0", "With $N = 1$ the unknowns are three torque changes"),
    )),
    # ---------------------------------------- causes that a separate test removes
    Exempt("measured", LESSONS + "interventions.py::test_a_hand_without_a_damper_swings_like_the_wish", (
        ("one-task/1", "Equation (4) has become a weakly damped oscillator"),
    )),
    Exempt("measured", (
        LESSONS + "interventions.py::test_a_distance_that_is_not_at_its_bound_changes_no_error"
    ), (
        ("keeping-clear/2", "Where the bound is not active, it causes no error."),
    )),
    Exempt("measured", LESSONS + "derivations.py::test_a_direction_that_is_nobodys_keeps_its_torque", (
        ("one-task/3", "$R$ weighs changes of torque, so in that direction"),
        ("settings", "R weighs changes of torque only"),
        ("lessons/settings/torque_entries.py", "R weighs changes of torque only"),
        ("app/panels/torque/tasks.py", "R weighs changes of torque only"),
    )),
    Exempt("measured", LESSONS + "geometry.py::test_a_torque_bound_cuts", (
        ("inside-the-qp/2", "At every tick $\\Delta\\tau$ is limited by the distance from the torque"),
    )),
    Exempt("measured", (
        LESSONS + "architectures.py::test_a_base_that_stays_behind_the_hand_drives_no_farther"
    ), (
        ("deliveries/0", "The distance is shorter because the robot's base stays behind its hand"),
        ("deliveries/1", "The ghost's base drives only a tenth farther"),
    )),
    Exempt("measured", LESSONS + "architectures.py::test_the_factor_hangs_on_the_rule", (
        ("deliveries/1", "So the factor between the two ways of working depends on the rule"),
        ("deliveries/1", "About half of this saving is due to the rule"),
    )),
    # ---------------------------------------- behaviour of the program
    Exempt("software", LESSONS + "grade_attacks.py::test_a_table_of_grades_is_no_program_of_a_spreadsheet", (
        ("instructors", "In the file of the table, an apostrophe precedes every"),
    )),
    Exempt("software", LESSONS + "own_tasks.py::test_a_code_tells_an_own_task_by_its_content", (
        ("instructors", "A state code (*Export*, *Write it down*) contains"),
    )),
    Exempt("software", (
        HIMPC + "adaptation.py::test_the_largest_eigenvalue_is_one_at_the_payload_and_less_at_a_heavier_one"
    ), (
        ("results", "`M_bar_adapt=true` estimates the payload from the torque that balances gravity"),
    )),
    Exempt("software", "tests/app/test_app_guard.py::test_without_the_token_nothing_opens", (
        ("serving", "Everybody who can open the page can run simulations"),
    )),
    Exempt("software", (
        "tests/app/test_app_opening.py::test_no_argument_list_holds_what_the_browser_is_opened_with"
    ), (
        ("serving", "The address itself is not an argument of the browser, because"),
    )),
    Exempt("software", "tests/app/test_app_guard.py::test_cookies_of_two_servers_live_in_one_jar", (
        ("serving", "Browsers send cookies of one host to the servers at all its ports"),
    )),
    Exempt("software", LESSONS + "progress.py::test_a_signature_is_of_one_key", (
        ("app/panels/run/hand_in.py", "This lab has no instructor's key"),
    )),
    Exempt("software", "tests/app/test_app_door.py::test_other_sites_are_refused", (
        ("app/server/door.py", "The request comes from a page of another site."),
    )),
)
# fmt: on
