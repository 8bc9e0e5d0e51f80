"""Label, unit, help text and usual range of every setting of velocity-level scenes."""

from __future__ import annotations

from lessons.settings.entry import Entry

_SCALE = "Factor on the limits of the robot"
_EFFORT = "Weight in the effort (10), equal for all joints"
_CARRIED_OUT = (
    "hierarchical: the robot carries out two tasks at a time. single_task: one task at a time, with the "
    "whole body. decoupled: one task at a time, with the base or the arm"
)

VELOCITY_ENTRIES = (
    Entry("controller", "Controller", "You can switch the controller while the robot moves"),
    Entry("horizon", "N", "Number of knots of the prediction horizon", low=1, high=40,
          tries=("1", "2", "5", "10", "20"), name="horizon N"),
    Entry("dt", "Δt", "Time between two knots", "s", 20, 300, 10, shown="ms", factor=1e3),
    Entry("rate_hz", "Rate", "Control steps per second; 10 in the paper", "Hz", 2, 50, 1),
    Entry("delta_m", "δ", "Amount by which a lower level may increase the error of a higher level at a "
              "knot, (13)",
          "m", 0, 100, 1, shown="mm", factor=1e3, tries=("0.002", "0.02", "0.05"), name="δ of (13), m"),
    Entry("formulation", "Formulation",
          "paper: the cost of every level contains the absolute effort (10). proximal: the cost of upper "
              "levels contains the deviation from the previous plan instead"),
    Entry("lexicographic", "Lexicographic",
          "per_coordinate: (12), bounds every error. cost: (11), bounds the cost of the level"),
    Entry("max_iter", "MAX_ITER", "Largest number of QPs per level and control step", low=1, high=10),
    Entry("terminal", "P / Q", "Weight of the last knot relative to the others, (8)", "", 0, 100, 1),
    Entry("velocity_effort", "S velocities", _EFFORT, "", 0.0, 2.0, 0.01),
    Entry("input_effort", "R inputs", _EFFORT, "", 0.0, 1.0, 0.01),
    Entry("change_effort", "W changes", _EFFORT, "", 0.0, 1.0, 0.01),
    Entry("gains", "Gains", "Gains of HTIDKC and placo, one per level: ẋ = ṙ + gain · (r − x)", "1/s"),
    Entry("gains.*", "Gain of level *", "ẋ = ṙ + gain · (r − x)", "1/s", 0.0, 3.0, 0.05),
    Entry("rho", "ρ", "Weight of ‖q̇‖² in every level of HTIDKC, and in the QP of placo", "", 1e-3, 1.0,
          log=True),
    Entry("first_level", "First level of placo",
          "scaled: kept exactly, with a velocity that is reduced as far as the limits require. hard: kept "
              "exactly, or the robot brakes. soft: weighed by its Q like the other levels"),
    Entry("limits.position", "Position", "Impose the position limits of the joints", name="position limits"),
    Entry("limits.velocity", "Velocity", "Impose the velocity limits", name="velocity limits"),
    Entry("limits.acceleration", "Acceleration", "Impose the acceleration limits",
          name="acceleration limits"),
    Entry("limits.jerk", "Jerk", "Impose the jerk limits", name="jerk limits"),
    Entry("limits.velocity_scale", "Velocity scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.acceleration_scale", "Acceleration scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.jerk_scale", "Jerk scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.jerk_limit", "Jerk limit", "Jerk limit per joint; null: 10 for the base, 80 for the arm",
          "rad/s³ or m/s³"),
    Entry("margin_m", "Margin", "Smallest distance that the robot keeps from obstacles, (7c)", "m", 0, 50, 1,
          shown="cm", factor=1e2),
    Entry("self_collision", "Keep the arm clear of the base",
          "Hand and forearm avoid collisions with the platform"),
    Entry("hold", "Hold", "Names of the joints that stay at rest"),
    Entry("base", "Base", "Type of motion of the base"),
    Entry("solver", "QP solver",
          "daqp: used by HTIDKC, and by the other controllers if the compiled method finds no solution. "
              "proxqp and qpoases solve all QPs"),
    Entry("compensate_delay", "Compensate delay",
          "Predict the measured state forward by the plant's lag before planning", tries=("false", "true"),
          name="delay compensated"),
    Entry("delay_measured", "Delay as measured",
          "Delay each command by its computing time, as on a real robot, which does not wait"),
    Entry("Q", "Q", "Weight of the errors relative to the effort; sets all levels at once", "", 0.1, 100.0,
          0.1),
    Entry("levels.*.enabled", "Enabled", "Whether the level takes part", tries=("false", "true"),
          name="level * on"),
    Entry("levels.*.Q", "Q", "Weight of this level's errors relative to its effort", "", 0.1, 100.0, 0.1,
          tries=("20", "100", "200", "500", "2000"), name="Q of *"),
    Entry("plant.mode", "Plant",
          "ideal: the joints follow the command exactly. servo: MuJoCo's mechanics under joint velocity "
              "servos"),
    Entry("plant.bandwidth", "Bandwidth", "Bandwidth of the velocity servos (servo plant)", "1/s", 1, 300, 1),
    Entry("plant.lag_ms", "Lag", "Time constant of the first-order lag between command and servo", "ms", 0,
          300, 5),
    Entry("plant.delay_ms", "Delay", "Time after which a command acts", "ms", 0, 300, 5,
          tries=("1", "2", "0"), name="delay of the command, ms"),
    Entry("plant.position_noise", "Position noise", "Standard deviation, rad and m", "rad or m", 0, 10, 0.1,
          shown="10⁻³", factor=1e3),
    Entry("plant.velocity_noise", "Velocity noise", "Standard deviation, rad/s and m/s", "rad/s or m/s", 0,
          100, 1, shown="10⁻³", factor=1e3),
    Entry("plant.payload_kg", "Payload", "A mass at the hand (servo plant)", "kg", 0, 10, 0.5,
          tries=("3", "1", "2", "5", "0"), name="payload, kg"),
    Entry("plant.friction", "Coulomb friction", "Coulomb friction of every joint (servo plant)", "N·m", 0,
          20, 0.5),
    Entry("plant.damping", "Viscous friction", "Viscous friction of every joint (servo plant)", "N·m·s/rad",
          0, 20, 0.5),
    Entry("plant.saturate", "Motors saturate",
          "Clip the torque of the servos at the limits of the data sheet",
          tries=("false", "true"), name="torque bound of the motors"),
    Entry("order", "Order", "The roles, highest priority first: ee,base; takes effect when a run starts"),
    Entry("architecture", "Architecture", _CARRIED_OUT),
    Entry("base_tolerance", "Base is there within", "The task of the base is completed within this "
          "distance of its goal, for every architecture; takes effect at the next start. decoupled needs "
          "0.05 m and a base at rest", "m", 0.02, 1.0, 0.01,
          tries=("0.05", "0.25", "0.5"), name="base is there within, m"),
    Entry("base_at_rest", "and at rest", "The task of the base is completed only if the base is slower "
              "than 0.02 m/s",
          tries=("true",), name="base must come to rest"),
    Entry("peak", "Peak", "Goal of the base, x and y in the world frame", "m"),
    Entry("half_period", "Half period", "Duration of each of the two parts", "s", 1.0, 20.0, 0.5),
    Entry("height", "Height", "Height of the first waypoint of the hand", "m", 0.3, 1.5, 0.05),
    Entry("hold_s", "Hold", "Time that the hand stays at each goal; null: until it is released", "s", 0.0,
          5.0, 0.25),
    Entry("seats", "Seats", "Numbers of the people's seats, 0 to 5, in the order of the visits"),
    Entry("rounds", "Rounds", "Number of visits to each person", low=1, high=10),
    Entry("cruise", "Cruise", "Speed along the planned paths of the base", "m/s", 0.1, 1.0, 0.05),
    Entry("goal", "Goal", "Goal of the base, x and y", "m"),
    Entry("false_report", "Reported wrongly", "Whether a wrong position of the crate is reported to the "
          "controller for a while",
          tries=("false", "true"), name="false report"),
    Entry("report_offset", "Reported minus true position", "Position of the crate as it is reported, minus "
          "its true position, while the report is wrong", "m", -3.0, 3.0, 0.05),
    Entry("report_start", "Wrong from", "Time from which the report is wrong", "s", 0.0, 12.0, 0.5),
    Entry("report_end", "Right again from", "Time from which the report is right again", "s", 0.0, 12.0, 0.5,
          tries=("5", "6", "7", "8", "9"), name="report right again from, s"),
)  # fmt: skip
"""The order is that of the page. An entry with `tries` is offered for comparisons."""
