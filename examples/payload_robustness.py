"""An unknown payload is added while the arm holds its pose: compares how three controllers react.

After half of the time the plant's hand becomes heavier; the controllers do not know it. Prints a line per
controller: how far the hand sagged at most, and how far it is from its target at the end. Incremental control
(himpc) adds to the last torque, which already balances the new weight after one tick; model-based control
(osf) keeps an error that is proportional to the weight.
"""

from __future__ import annotations

import numpy as np

from lessons import begin, prepared, torque_scene
from lessons.events import Set


def main(seconds: float = 2.0, payload_kg: float = 3.0) -> None:
    """Prints the results that the module describes."""
    for controller in ("himpc", "tdeosf", "osf"):
        session = begin(prepared(torque_scene("iiwa14-hold"), controller, ()), seed=0)
        half, ticks = 0.5 * seconds, round(seconds / session.settings.T_s)
        errors = []
        for tick in range(ticks):
            if tick == ticks // 2:
                # A change during a run is an event; it takes effect at the beginning of the next tick.
                session.post(Set("plant.payload_kg", payload_kg))
            session.tick()
            if session.t > half and session.plan is not None:
                errors.append(float(np.linalg.norm(session.plan.errors["position"])))
        print(f"{controller}: sags by {1e3 * max(errors):.2f} mm, rests {1e3 * errors[-1]:.3f} mm off")


if __name__ == "__main__":
    main()
