"""A payload nobody told the controller of, picked up while the arm holds still: who notices?

After half of the time the plant's hand gets heavier. Prints a line per controller: how far the hand sagged at
most, and how far it still is from its place at the end. Incremental control (himpc) takes the new weight for
one more thing that the last torque already balanced; a model (osf) stays wrong by its weight.
"""

from __future__ import annotations

import numpy as np

from lessons import begin, prepared, torque_scene
from lessons.events import Set


def main(seconds: float = 2.0, payload_kg: float = 3.0) -> None:
    """Prints what the module's docstring says."""
    for controller in ("himpc", "tdeosf", "osf"):
        session = begin(prepared(torque_scene("iiwa14-hold"), controller, ()), seed=0)
        half, ticks = 0.5 * seconds, round(seconds / session.settings.T_s)
        errors = []
        for tick in range(ticks):
            if tick == ticks // 2:
                # What happens to a run is an event; it takes effect when the next tick begins.
                session.post(Set("plant.payload_kg", payload_kg))
            session.tick()
            if session.t > half and session.plan is not None:
                errors.append(float(np.linalg.norm(session.plan.errors["position"])))
        print(f"{controller}: sags by {1e3 * max(errors):.2f} mm, rests {1e3 * errors[-1]:.3f} mm off")


if __name__ == "__main__":
    main()
