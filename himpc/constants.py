"""Constants that the compiled tick and the printed equations share."""

RANK_TOLERANCE = 1e-10
"""A direction whose effect on a level is below this share of ‖B‖ is left to lower levels."""

RETURN_RATE = 5.0
"""1/s: a joint beyond its limit must return at this rate times the excess."""

WITHIN = 0.25
"""m: a pair of links, or of a link and an object, has no row if its distance is larger."""
FADE = 0.05
"""m: from WITHIN − FADE to WITHIN, a bound fades out with growing distance. The bound of a pair that comes
nearer than WITHIN appears without a jump."""
RETREAT = 0.2
"""m/s: a row of a distance never demands that the distance increases faster than this."""
TURN_PULL = 5.0
"""rad/m: the largest error on which a task of angles acts, divided by the largest error on which a task of
positions acts."""

AT_TORQUE, AT_VELOCITY, AT_POSITION = 1, 2, 4
"""Bits of telemetry's `at_bound`: which limits bind. Velocity rows that impose a position limit count as
position."""

APPROACH_RATE = 6.0
"""1/s: rate at which a dragged target reduces its remaining distance near the raw target."""
VELOCITY_RATE = 36.0
"""1/s: rate at which the velocity of a dragged target approaches the desired velocity."""
STILL = 1e-9
"""A dragged target with a smaller distance and speed is set to rest and does not drift."""

LOAD_SECONDS = 0.1
"""s: time constant of the mean load of a motor. A short peak of torque does not slow the robot down."""
FREE_LOAD, FULL_LOAD = 0.55, 0.95
"""Shares of the torque limit. Below the first, a motor does not slow its joints down. Above the second, its
joints have their lowest velocity limit."""
SLOWEST_SHARE = 0.03
"""The velocity limit of a joint whose motor is loaded is not reduced below this share of the full limit."""
HEAVY_LOAD = 0.85
"""If a motor has at least this load and the tasks make no progress, the robot counts as stalled."""

MEAN_SECONDS = 0.02
"""s: time constant of the mean velocity. The difference between velocity and mean velocity is a smooth
measure of the acceleration."""
LEAD = 0.1
"""s: the velocity is extrapolated over this time, and the extrapolated velocity must be within its limit."""
LEAST_WHILE_FASTER = 0.5
"""The velocity limit of a joint that accelerates is not reduced below this share of the full limit."""

BLOCKED = 0.1
"""m: a robot counts as stalled only if the distance of a pair exceeds d_safe by less than this."""
INSIDE = -0.03
"""m: a pair that is nearer than d_safe by more than this must move apart, and the robot is not slowed down. A
robot with a smaller violation counts as stalled if the violation does not decrease."""
PROGRESS = 0.05
"""m/s, rad/s: an error makes progress if it decreases faster than this plus PROGRESS_SHARE times the error.
"""
PROGRESS_SHARE = 0.25
"""1/s: see PROGRESS. Without an obstacle, errors decrease ten times as fast as this share requires."""
MOVING, MOVING_ANYWHERE = 0.01, 0.05
"""m/s, rad/s: a reference or an object that is faster than the first counts as moving. The second is for
robots without distances, for which an obstacle is always near: they come to rest sooner."""
CLOSE_ENOUGH = 0.01
"""m, rad: a task with a smaller error has reached its target."""
SLOWING, RECOVERY = 0.1, 0.05
"""s: time constant with which the joints of a stalled robot slow down, and time constant with which they
later speed up again."""
DISTURBED = 0.03
"""m, rad: if the error of the first task grows by more than this, a disturbance has moved the robot, and the
robot is no longer slowed down."""
STALLED, REST = 0.5, 0.02
"""Thresholds for `Stall.share`. Below STALLED, the robot stays slow until a reference moves, no obstacle is
near, or its first task is disturbed. At REST or below, the robot has come to rest. Between the two, the robot
brakes, and a change of errors is neither progress nor a disturbance."""
SLOWEST = 0.02
"""rad/s: the velocity limit of a stalled robot's joint is not reduced below this."""
LEAST_SHARE = 1e-9
"""Least factor on the velocity limits of a stalled robot. It is positive, and an infinite limit stays
infinite."""
