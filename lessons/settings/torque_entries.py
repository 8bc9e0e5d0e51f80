"""Label, unit, help text and usual range of every setting of torque-level scenes."""

from __future__ import annotations

from lessons.settings.entry import Entry

_BELIEVED = "Value in the nominal model, which model-based controllers use"

TORQUE_ENTRIES = (
    Entry("controller", "Controller",
          "You can switch the controller while the robot moves; within a few tenths of a "
              "second, the torque becomes that of the new controller"),
    Entry("horizon", "N", "Number of knots of the prediction horizon; 1 is the inverse dynamics hierarchy",
          low=1, high=30, tries=("1", "2", "5", "10", "20"), name="horizon N"),
    Entry("T_s", "T_s", "Control period; also the time allowed for each control step", "s", 0.5, 5.0, 0.5,
          shown="ms", factor=1e3, tries=("0.002", "0.004", "0.001"), name="control period T_s, s"),
    Entry("deadline_ms", "Due after",
          "A torque that is computed later than this acts one tick later; until then the previous torque is "
              "held. 0: simulated time waits while the controller computes",
          "ms", 0.0, 5.0, 0.1),
    Entry("solve_ms_per_knot", "Per knot",
          "Assumed computing time per knot of the horizon. 0: the measured computing time of this computer",
          "ms", 0.0, 0.5, 0.01),
    Entry("M_bar_scale", "M̄ scale", "One factor on the whole diagonal of M̄", "", 0.1, 5.0, 0.05,
          tries=("4", "2", "1", "0.5")),
    Entry("M_bar_adapt", "M̄ adapts to the payload",
          "The controller estimates the payload from the torque against gravity, and sets M̄ as large as "
              "the nominal model with that payload allows",
          tries=("true", "false"), name="M̄ adapts"),
    Entry("M_bar", "M̄", "The diagonal of M̄, one number per joint, before scaling", "kg·m²"),
    Entry("limits.position", "Position",
          "viability: limits the speed to one from which the joint can still stop. paper: the rows as "
              "printed, which a horizon of a few milliseconds cannot keep, as the list of fallbacks shows",
          tries=("paper", "off", "viability"), name="position limits"),
    Entry("limits.torque", "Torque", "Impose the torque limits, (32f)", name="torque limits"),
    Entry("limits.velocity", "Velocity", "Impose the velocity limits, (32e)", name="velocity limits"),
    Entry("limits.torque_scale", "Torque scale", "One factor on the robot's torque limits", "", 0.05, 2.0,
          0.01),
    Entry("limits.velocity_scale", "Velocity scale", "One factor on the robot's velocity limits", "", 0.05,
          2.0, 0.01),
    Entry("limits.velocity_approach", "Approach",
          "Largest rate at which a joint may approach its velocity bound, relative to the remaining "
              "distance; 0: (32e) as printed",
          "1/s", 0.0, 100.0, 1.0),
    Entry("limits.torque_rate", "Torque rate",
          "Largest change of each joint's torque per second; in himpc, hiqp, nhimpc, weighted and "
              "himpc_printed this limit ranks above all levels. 0: not imposed",
          "N·m/s", 0.0, 2000.0, 10.0, name="torque rate limit"),
    Entry("limits.stall_guard", "Rest when blocked",
          "A robot whose torque rises without progress of its tasks comes to rest, also if no distances are "
              "kept. Without this guard, as printed, time-delay estimation increases the torque until it is "
              "at its limit. himpc, hiqp, nhimpc, weighted and himpc_printed have the guard, and always "
              "while they keep distances",
          tries=("false", "true"), name="guard of a blocked robot"),
    Entry("avoidance.on", "Keep distances",
          "Keep distances between links, and between links and objects. himpc, hiqp, nhimpc, weighted and "
              "himpc_printed do this by bounds above all levels, himpc_filtered by a filter behind its "
              "levels",
          tries=("true", "false"), name="distances kept"),
    Entry("avoidance.d_safe", "d_safe", "Smallest distance that is allowed", "m", 0.0, 100.0, 1.0, shown="mm",
          factor=1e3, name="safe distance"),
    Entry("avoidance.margin", "Margin",
          "Added to d_safe, for the delay of time-delay estimation", "m", 0.0, 100.0, 1.0, shown="mm",
          factor=1e3, name="margin of distances"),
    Entry("avoidance.reaction", "Reaction", "Time that the bound assumes before the robot brakes", "s",
          0.0, 1.0, 0.01, name="reaction of distances"),
    Entry("avoidance.deceleration", "Deceleration",
          "Deceleration that the bound assumes for the approach to an object", "m/s²", 0.1, 20.0,
          0.1, name="deceleration of distances"),
    Entry("avoidance.pull", "Pull",
          "While distances are kept, a larger error of a position has the effect of this error. For other "
              "tasks the limit is five times this number, in rad. 0: no limit",
          "m", 0.0, 2.0, 0.01, name="pull of targets"),
    Entry("avoidance.velocity_margin", "Free velocity",
          "Share of the velocity limits that is not used while distances are kept, for the delay of "
              "time-delay estimation",
          "", 0.0, 0.5, 0.01, name="margin of velocities"),
    Entry("solver", "QP solver",
          "Solver of the QPs of hqp and himpc_printed. Other controllers accept daqp only. qpoases needs "
              "the extra 'bench'"),
    Entry("R_on", "R weighs", "Quantity that R weighs: Δτ as printed, or M̄⁻¹Δτ"),
    Entry("damping", "Damp what no level controls",
          "R weighs changes of torque only, so a motion without a task keeps its torque and does not "
              "stop after a push. The last level brings this motion to rest. To see the effect, switch it "
              "off and push the robot.",
          tries=("false", "true"), name="damping level"),
    Entry("order", "Order", "The levels, highest priority first: a,b,c or a list"),
    Entry("stack", "Stack",
          "The levels with their tasks, highest priority first, as a list; see himpc.tasks.KINDS"),
    Entry("Q", "Q", "Weight of the residual; sets all levels at once", "", 1.0, 1000.0, 1.0),
    Entry("R", "R", "Weight of the changes of torque; sets all levels at once", "", 0.1, 100.0, 0.1),
    Entry("levels.*.enabled", "Enabled", "Whether the level takes part", tries=("false", "true"),
          name="level * on"),
    Entry("levels.*.Q", "Q", "Weight of the residual", "", 1.0, 1000.0, 1.0,
          tries=("20", "100", "200", "500", "2000"), name="Q of *"),
    Entry("levels.*.R", "R", "Weight of the changes of torque", "", 0.1, 100.0, 0.1,
          tries=("1", "10", "100", "1000"), name="R of *"),
    Entry("levels.*.horizon", "Own N",
          "Number of knots in this level's horizon, at most N (Remark 8); null: N", name="N of *"),
    Entry("levels.*.K_p", "K_P", "Stiffness of all tasks of the level", "1/s²", 0.0, 1000.0, 1.0),
    Entry("levels.*.K_v", "K_V", "Damping of all tasks of the level", "1/s", 0.0, 100.0, 0.5),
    Entry("tasks.*.K_p", "K_P", "Stiffness", "1/s²", 0.0, 1000.0, 1.0, name="K_P of *"),
    Entry("tasks.*.K_v", "K_V", "Damping", "1/s", 0.0, 100.0, 0.5, name="K_V of *"),
    Entry("plant.payload_kg", "Payload", "A mass at the hand that the controller does not know", "kg", 0.0,
          10.0, 0.1, tries=("3", "1", "2", "5", "0"), name="payload, kg"),
    Entry("plant.friction", "Coulomb friction", "Coulomb friction of every joint", "N·m", 0.0, 10.0, 0.1),
    Entry("plant.damping", "Viscous friction", "Viscous friction of every joint", "N·m·s/rad", 0.0, 10.0,
          0.1),
    Entry("plant.armature", "Armature", "Reflected inertia of the motors", "kg·m²", 0.0, 1.0, 0.01),
    Entry("plant.mass_scale", "Mass scale", "Factor on the mass of every link", "", 0.2, 3.0, 0.05),
    Entry("plant.inertia_scale", "Inertia scale", "Factor on the rotational inertia of every link",
          "", 0.2, 3.0, 0.05, tries=("0.8", "1.2", "1"), name="true inertias ×"),
    Entry("plant.diagonal_scale", "M(q) diagonal scale",
          "Factor on the diagonal of M(q) alone, as the text of the paper's Table V says; no real arm has "
              "this property",
          "", 0.5, 2.0, 0.05),
    Entry("plant.encoder_resolution_deg", "Encoder", "Resolution of the joint sensors; 0: ideal sensors",
          "°", 0.0, 20.0, 0.25, shown="10⁻³ °", factor=1e3, tries=("0.005", "0.001", "0.01", "0"),
          name="encoder resolution, °"),
    Entry("plant.torque_lag_ms", "Torque lag", "First-order lag of the motors", "ms", 0.0, 20.0, 0.5),
    Entry("plant.delay_ms", "Delay", "Time from command to torque", "ms", 0.0, 10.0, 0.5,
          tries=("1", "2", "0"), name="delay of the command, ms"),
    Entry("plant.saturate", "Motors saturate", "Clip the torque at the limits of the data sheet",
          tries=("false", "true"), name="torque bound of the motors"),
    Entry("plant.gravity", "Gravity", "Whether gravity acts on the plant"),
    Entry("plant.contacts", "Contacts",
          "The robot touches itself and the objects around it. If switched off, it passes through them",
          tries=("false", "true"), name="contacts"),
    Entry("plant.joint_stops", "Joint stops",
          "A joint that is pushed to its limit stops there. If switched off, it moves on"),
    Entry("nominal.payload_kg", "Believed payload", _BELIEVED, "kg", 0.0, 10.0, 0.1),
    Entry("nominal.damping", "Believed viscous friction", _BELIEVED, "N·m·s/rad", 0.0, 10.0, 0.1),
    Entry("nominal.armature", "Believed armature", _BELIEVED, "kg·m²", 0.0, 1.0, 0.01),
    Entry("nominal.mass_scale", "Believed mass scale", _BELIEVED, "", 0.2, 3.0, 0.05),
    Entry("nominal.inertia_scale", "Believed inertia scale", _BELIEVED, "", 0.2, 3.0, 0.05),
    Entry("nominal.gravity", "Believed gravity", _BELIEVED),
    Entry("q1_amplitude_deg", "Swing of q₁", "Angle by which joint 1 swings before it returns", "°", -180.0,
          180.0, 5.0),
    Entry("smooth", "Smooth", "Use the phase ωt − sin ωt, which is at rest in the singular point, instead "
              "of ωt"),
)  # fmt: skip
"""The order is that of the page. An entry with `tries` is offered for comparisons."""
