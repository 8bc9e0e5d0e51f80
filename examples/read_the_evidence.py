"""Reading the evidence of a tick: cost, KKT residual, priority leak, and which bound limits which level.

The planar arm cannot do both of its tasks at once. Prints, for one tick in the middle of the run, a line per
level and a line per binding constraint; then, over the whole run, the largest KKT residual, the largest
priority leak and the number of QPs without a verified solution.
"""

from __future__ import annotations

import numpy as np

from lessons import begin, prepared, torque_scene


def main(seconds: float = 4.0) -> None:
    """Prints the results that the module describes."""
    # A session is a run that your program advances one tick at a time.
    session = begin(prepared(torque_scene("planar3-conflict"), "himpc", ()), seed=0)
    ticks = round(seconds / session.settings.T_s)
    residual, leak, unsolved, solved = 0.0, 0.0, 0, 0
    for tick in range(ticks):
        session.tick()
        plan = session.plan
        assert plan is not None  # every tick sets the plan
        residual = max(residual, plan.kkt_residual)
        leak = max(leak, plan.leak or 0.0)
        unsolved, solved = unsolved + plan.unsolved, solved + len(plan.levels)
        if tick == ticks // 2:
            for level in plan.levels:
                print(
                    f"level {level.name}: cost {level.cost:.3g}, increment {np.round(level.U[0], 4)} N·m, "
                    f"KKT residual {level.kkt_residual:.1e}, {level.fallback} in {level.time_us:.0f} µs"
                )
            for each in plan.binding(session.robot.joint_names):
                print(
                    f"binds: {each.side} {each.kind} of {each.joint} at knot {each.knot} on level "
                    f"{each.level}, multiplier {each.multiplier:.3g}"
                )
    print(f"largest KKT residual: {residual:.1e}")
    print(f"largest priority leak: {leak:.1e}")
    print(f"unsolved: {unsolved} of {solved} QPs")


if __name__ == "__main__":
    main()
