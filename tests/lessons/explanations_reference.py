"""The same entries as in `explanations_exempt`, for texts in the source: the reference, and messages of the
program."""

from __future__ import annotations

from explanations_exempt import FURTHER, HIMPC, LESSONS, Exempt

ROBOTS, HTMPC = "tests/robots/test_robots_", "tests/himpc/test_htmpc_"

# fmt: off
REFERENCE = (
    # ---------------------------------------- sentences that cannot be false
    Exempt("definition", "", (
        ("himpc/controllers/nhimpc.py", "The problem is then nonlinear, because"),
        ("himpc/controllers/null_space_control.py", "There is no QP, so the KKT residual is NaN."),
        ("himpc/controllers/one_step.py", "accelerations: q̈_p (n,)"),
        ("himpc/limits/braking.py", "Returns the least slack of the rows of velocity"),
        ("himpc/tasks/pointing.py", "s = Rᵀ(c − p) is the point in the frame's coordinates"),
        ("lessons/papers/reproduce.py", "*agrees*: the ratio is within 10 % of 1"),
        ("lessons/session/session.py", "seed: seed of the run; all randomness comes from it"),
    )),
    Exempt("purpose", "", (
        ("robots/shapes/capsules.py", "Returns vertices that are modelled along z"),
        ("robots/shapes/capsules.py", "Returns the mesh with separate vertices for the caps"),
        ("himpc/formulation/forms.py", "All active levels, their rows stacked"),
        ("himpc/limits/rows.py", "All rows are in N·m"),
        ("himpc/references/square_wave.py", "A switch takes place earlier by this time"),
        ("himpc/stack.py", "The generic rank is the largest rank over a few random"),
        ("lessons/own/deadline.py", "The waiting time is read only after the first alarm"),
        ("lessons/papers/himpc_paper/ablations.py", "All tasks are in one cost, one step ahead"),
        ("lessons/scenes/planar.py", "The plant applies any torque"),
        ("lessons/settings/assignments.py", "The controller comes first"),
        ("lessons/settings/missions.py", "Scenes whose tasks last for the whole run"),
    )),
    # ---------------------------------------- sentences that follow from equations
    Exempt("mathematics", (
        "tests/commands/test_commands_export_safety.py"
        "::test_none_of_a_thousand_images_with_one_wrong_bit_is_accepted"
    ), (
        ("himpc/export/entries.py", "Each step can be inverted"),
    )),
    Exempt("mathematics", (
        LESSONS + "derivations.py::test_an_error_of_acceleration_is_mapped_by_I_minus_M_inverse_M_bar"
    ), (
        ("robots/inertia.py", "From one period to the next, the estimation error is multiplied"),
        ("examples/horizon_and_M_bar.py", "Time-delay estimation multiplies its error"),
    )),
    Exempt("mathematics", FURTHER + "an_equation_holds", (
        ("robots/inertia.py", "M⁻¹M̄ is similar to S"),
    )),
    Exempt("mathematics", ROBOTS + "inertia.py::test_suggestion_is_stable_at_unseen_configurations", (
        ("robots/inertia.py", "1. shape: D_i = min over samples"),
    )),
    Exempt("mathematics", ROBOTS + "urdf_fuzz.py::test_the_nearest_physical_inertia_is_physical", (
        ("robots/urdf/inertials.py", "A body's inertia is I = tr(Σ)·1 − Σ"),
    )),
    Exempt("mathematics", HIMPC + (
        "adaptation.py::test_the_largest_eigenvalue_is_one_at_the_payload_and_less_at_a_heavier_one"
    ), (
        ("himpc/controllers/adaptation.py", "By construction M̄ ⪯ M̂, so"),
    )),
    Exempt("mathematics", HIMPC + "cascade.py::test_lower_levels_change_nothing_above", (
        ("himpc/printed.py", "For every y, J_p M̄⁻¹ Δτ keeps the value"),
    )),
    Exempt("mathematics", HIMPC + "rivals.py::test_hqp_meets_its_kkt_conditions", (
        ("himpc/controllers/hqp.py", "This form needs no inverse of a product of Jacobians"),
    )),
    Exempt("mathematics", HTMPC + "equations.py::test_the_shifted_plan_has_the_old_plans_velocities", (
        ("himpc/htmpc/continuing.py", "Therefore the velocities at the new knots"),
    )),
    Exempt("mathematics", HTMPC + "equations.py::test_prediction_is_the_integral_of_the_inputs", (
        ("himpc/htmpc/prediction.py", "The input is constant between knots"),
    )),
    Exempt("mathematics", HTMPC + "equations.py::test_ramp_and_stop_rows_leave_a_way_on", (
        ("himpc/htmpc/rows.py", "Two groups of rows concern the time beyond the horizon"),
    )),
    Exempt("mathematics", HTMPC + "loop.py::test_htidkc_first_step_by_hand", (
        ("himpc/htmpc/htidkc.py", "The bounds form a box, one interval per joint"),
    )),
    Exempt("mathematics", HIMPC + (
        "errors.py::test_what_controllers_take_for_its_derivative_is_the_errors_own"
    ), (
        ("himpc/tasks/orientation.py", "Stability needs the component along x̃ only: d/dt ½‖x̃‖²"),
    )),
    Exempt("mathematics", HIMPC + "references.py::test_a_dragged_position_keeps_its_caps_and_its_promises", (
        ("himpc/references/target.py", "It is filtered so that"),
        ("himpc/references/target.py", "The acceleration a is constant in each step"),
    )),
    Exempt("mathematics", LESSONS + "geometry.py::test_the_box_is_where_the_rows_hold", (
        ("lessons/geometry/plane.py", "The bounds are a box"),
    )),
    Exempt("mathematics", LESSONS + "geometry.py::test_geometry_and_solver_find_the_same_points", (
        ("lessons/scenes/plane.py", "The wrist is where joint 3 sits"),
    )),
    # ---------------------------------------- sentences about the program
    Exempt("software", ROBOTS + "mobile.py::test_ideal_kinematics_are_the_double_integrator", (
        ("robots/servo.py", "mode: \"ideal\": within each step, the velocity changes linearly"),
    )),
    Exempt("software", ROBOTS + "signals.py::test_configure_keeps_the_state_and_the_memory", (
        ("robots/signals.py", "Commands are stored with their times"),
    )),
    Exempt("software", ROBOTS + "shapes.py::test_simplified_surfaces_stay_where_they_were", (
        ("robots/meshes/simplify.py", "Vertices whose normals point to different sides"),
    )),
    Exempt("software", ROBOTS + "urdf.py::test_continuous_becomes_unbounded_with_one_coordinate", (
        ("robots/urdf/joints.py", "Rewrites all joints so that"),
    )),
    Exempt("software", ROBOTS + (
        "urdf.py::test_the_driver_of_a_mimic_gripper_is_fixed_but_a_parallel_arm_is_not"
    ), (
        ("robots/urdf/joints.py", "' mimics it, so it drives a gripper"),
    )),
    Exempt("software", HIMPC + "braking.py::test_braking_meets_all_rows_whenever_any_increments_do", (
        ("himpc/controllers/printed_tick.py", "So the increments meet all rows"),
    )),
    Exempt("software", HIMPC + "fallbacks.py::test_least_slack_makes_any_rows_feasible", (
        ("himpc/cascade/last_resort.py", "N·m added to the least slack"),
    )),
    Exempt("software", HIMPC + "controller.py::test_the_controller_sees_no_mass", (
        ("himpc/kinematics/configuration.py", "Only geometry is used, no inertia or gravity"),
    )),
    Exempt("software", HTMPC + "active_set.py::test_rows_that_contradict_each_other_are_found_out", (
        ("himpc/htmpc/active_set.py", "A row that depends linearly on the active rows does not enlarge"),
    )),
    Exempt("software", HTMPC + "loop.py::test_every_setting_changes_live_without_a_jump", (
        ("himpc/htmpc/htmpc.py", "`configure` changes settings and keeps these plans"),
    )),
    Exempt("software", HTMPC + "equations.py::test_too_many_coordinates_are_explained", (
        ("himpc/htmpc/tracking.py", "InputError: the sum is too large, so that no freedom is left"),
    )),
    Exempt("software", HIMPC + "limits.py::test_tightened_limits_close_in_and_arrive", (
        ("himpc/limits/ramp.py", "Then it moves to its goal with time constant RAMP_SECONDS"),
    )),
    Exempt("software", LESSONS + "sweep.py::test_all_cores_give_the_same_result_as_one", (
        ("lessons/parallel.py", "Outcomes come in the order in which they are ready"),
    )),
    Exempt("software", (
        LESSONS + "export.py::test_a_script_of_measured_deadlines_says_that_it_cannot_repeat"
    ), (
        ("lessons/replay/script.py", "Measured computing times changed the run"),
    )),
    Exempt("software", LESSONS + "switch.py::test_the_torque_goes_from_one_controller_to_the_other", (
        ("lessons/session/bumpless.py", "Therefore the blend lies within the torque bounds"),
    )),
    Exempt("software", LESSONS + "deadline.py::test_always_late_is_one_tick_of_delay", (
        ("lessons/session/deadline.py", "So one late tick costs one tick of holding"),
    )),
    Exempt("software", LESSONS + "architectures.py::test_all_architectures_have_one_mission", (
        ("lessons/settings/missions.py", "The HTMPC paper does not print when a task"),
    )),
    Exempt("software", LESSONS + "deadline.py::test_the_clock_decides_only_if_asked_to", (
        ("lessons/settings/settings.py", "Whether measured computing times change the run"),
    )),
    Exempt("software", LESSONS + "deadline.py::test_the_horizon_decides_what_is_late", (
        ("lessons/settings/torque.py", "solve_ms_per_knot: assumed computing time"),
    )),
)
# fmt: on
