"""The settings of velocity-level scenes, for people."""

from __future__ import annotations

from lessons.settings.entry import Entry

_SCALE = "Factor on the robot's own limits"
_EFFORT = "Weight of (10), the same for these joints"
_CARRIED_OUT = (
    "hierarchical: two tasks at a time. single_task: one at a time by the whole body. "
    "decoupled: one at a time, by base or arm"
)

VELOCITY_ENTRIES = (
    Entry("controller", "Controller", "Switch while it moves"),
    Entry("horizon", "N", "Knots the controller looks ahead", low=1, high=40,
          tries=("1", "2", "5", "10", "20"), name="horizon N"),
    Entry("dt", "Δt", "Between two knots", "s", 20, 300, 10, shown="ms", factor=1e3),
    Entry("rate_hz", "Rate", "Control steps per second; 10 in the paper", "Hz", 2, 50, 1),
    Entry("delta_m", "δ", "By how much a lower level may enlarge the error of a higher one at a knot, (13)",
          "m", 0, 100, 1, shown="mm", factor=1e3, tries=("0.002", "0.02", "0.05"), name="δ of (13), m"),
    Entry("formulation", "Formulation",
          "paper: every level pays the absolute effort (10). proximal: upper levels pay for leaving the "
              "previous plan"),
    Entry("lexicographic", "Lexicographic",
          "per_coordinate: (12), a bound on every error. cost: (11), a bound on the level's cost"),
    Entry("max_iter", "MAX_ITER", "QPs per level and control step", low=1, high=10),
    Entry("terminal", "P / Q", "Weight of the last knot against the others, (8)", "", 0, 100, 1),
    Entry("velocity_effort", "S velocities", _EFFORT, "", 0.0, 2.0, 0.01),
    Entry("input_effort", "R inputs", _EFFORT, "", 0.0, 1.0, 0.01),
    Entry("change_effort", "W changes", _EFFORT, "", 0.0, 1.0, 0.01),
    Entry("gains", "Gains", "Of HTIDKC, one per level: ẋ = ṙ + gain · (r − x)", "1/s"),
    Entry("gains.*", "Gain of level *", "ẋ = ṙ + gain · (r − x)", "1/s", 0.0, 3.0, 0.05),
    Entry("rho", "ρ", "Of HTIDKC: weight of ‖q̇‖² in every level", "", 1e-3, 1.0, log=True),
    Entry("limits.position", "Position", "Impose the joints' range", name="position limits"),
    Entry("limits.velocity", "Velocity", "Impose the velocity limits", name="velocity limits"),
    Entry("limits.acceleration", "Acceleration", "Impose the limits", name="acceleration limits"),
    Entry("limits.jerk", "Jerk", "Impose the jerk limits", name="jerk limits"),
    Entry("limits.velocity_scale", "Velocity scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.acceleration_scale", "Acceleration scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.jerk_scale", "Jerk scale", _SCALE, "", 0.1, 2.0, 0.05),
    Entry("limits.jerk_limit", "Jerk limit", "Per joint; null: 10 for the base, 80 for the arm",
          "rad/s³ or m/s³"),
    Entry("margin_m", "Margin", "Kept clear of obstacles, (7c)", "m", 0, 50, 1, shown="cm", factor=1e2),
    Entry("self_collision", "Keep the arm clear of the base", "The hand and forearm keep off the platform"),
    Entry("hold", "Hold", "Joints that stay at rest, by name"),
    Entry("base", "Base", "How the base moves"),
    Entry("solver", "QP solver", "Where the compiled method gives none"),
    Entry("compensate_delay", "Compensate delay",
          "Predict the measured state forward by the plant's lag before planning", tries=("false", "true"),
          name="delay compensated"),
    Entry("delay_measured", "Delay as measured",
          "Commands arrive later by the time that planning took, as on a robot that does not wait"),
    Entry("Q", "Q", "Weight of the levels' errors against their effort, of all at once", "", 0.1, 100.0, 0.1),
    Entry("levels.*.enabled", "Enabled", "Whether it takes part", tries=("false", "true"), name="level * on"),
    Entry("levels.*.Q", "Q", "Weight of this level's errors against its effort", "", 0.1, 100.0, 0.1,
          tries=("20", "100", "200", "500", "2000"), name="Q of *"),
    Entry("plant.mode", "Plant",
          "ideal: the command is met exactly. servo: MuJoCo's mechanics under joint velocity servos"),
    Entry("plant.bandwidth", "Bandwidth", "Of the velocity servos (servo plant)", "1/s", 1, 300, 1),
    Entry("plant.lag_ms", "Lag", "First-order lag between command and servo", "ms", 0, 300, 5),
    Entry("plant.delay_ms", "Delay", "A command acts this much later", "ms", 0, 300, 5,
          tries=("1", "2", "0"), name="delay of the command, ms"),
    Entry("plant.position_noise", "Position noise", "Standard deviation, rad and m", "rad or m", 0, 10, 0.1,
          shown="10⁻³", factor=1e3),
    Entry("plant.velocity_noise", "Velocity noise", "Standard deviation, rad/s and m/s", "rad/s or m/s", 0,
          100, 1, shown="10⁻³", factor=1e3),
    Entry("plant.payload_kg", "Payload", "A mass at the hand (servo plant)", "kg", 0, 10, 0.5,
          tries=("3", "1", "2", "5", "0"), name="payload, kg"),
    Entry("plant.friction", "Coulomb friction", "The same at every joint (servo plant)", "N·m", 0, 20, 0.5),
    Entry("plant.damping", "Viscous friction", "The same at every joint (servo plant)", "N·m·s/rad", 0, 20,
          0.5),
    Entry("plant.saturate", "Motors saturate", "Clip the servos' torque at the data sheet's limits",
          tries=("false", "true"), name="torque bound of the motors"),
    Entry("order", "Order", "The roles, highest priority first: ee,base; takes effect when a run starts"),
    Entry("architecture", "Architecture", _CARRIED_OUT),
    Entry("base_tolerance", "Base is there within", "Of its place: then its task is completed, whatever the "
          "architecture; from the next start on. decoupled needs 0.05 m and rest", "m", 0.02, 1.0, 0.01,
          tries=("0.05", "0.25", "0.5"), name="base is there within, m"),
    Entry("base_at_rest", "and at rest", "Slower than 0.02 m/s, for the task of the base to be completed",
          tries=("true",), name="base must come to rest"),
    Entry("peak", "Peak", "Where the base is sent, x and y in the world", "m"),
    Entry("half_period", "Half period", "Length of each part", "s", 1.0, 20.0, 0.5),
    Entry("height", "Height", "Of the first waypoint of the hand", "m", 0.3, 1.5, 0.05),
    Entry("hold_s", "Hold", "At every goal of the hand; null: until released", "s", 0.0, 5.0, 0.25),
    Entry("seats", "Seats", "Which of the six seats the people sit on, 0 to 5, in the order of the visits"),
    Entry("rounds", "Rounds", "How often everybody is visited", low=1, high=10),
    Entry("cruise", "Cruise", "Speed of the planned paths of the base", "m/s", 0.1, 1.0, 0.05),
    Entry("goal", "Goal", "Where the base is sent, x and y", "m"),
)  # fmt: skip
"""In the order of the page. The usual comparisons are those with `tries`."""
