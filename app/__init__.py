"""The page: one simulation process per browser, the 3D view and the panels. The only door to viser.

A dragged target on its way down:
1. The browser tells where the gizmo is. `server/guard` counts the bytes, `page/inlet` refuses what is no
   place, and viser calls back on its loop: `view/target`, then `view/drag`.
2. `view/reachability`, on a thread of its own, finds what can be reached; `view/drag` posts a `MoveTarget`.
3. `client/simulation_client` puts it into `link/outbox`, which never waits; its thread writes to `link/wire`.
4. `worker/main` reads it and hands it to `worker/simulation`, which puts it into the session's mailbox.
5. The session (`lessons/session/session.py`) empties its mailbox when the next tick begins.

A row of telemetry on its way up:
1. A tick of the session returns it; `worker/simulation` writes it into `link/ring`, memory of both sides.
2. The page's thread (`page/page`, 30 Hz) asks `client/moment` for what to show, and that pulls the new rows.
3. `client/decimated` keeps, of each slice of time and each column, the least, the greatest and the last.
4. `page/layout` gives the moment to `page/torque_ui` or `velocity_ui`, which draws the panels' curves.
5. viser sends what changed. What is not worth a row each tick (settings, notices, how far a lesson is) comes
   ten times a second as a `Status` over `link/wire`, and `client/simulation` hears it.
"""

import os

# One thread per matrix product, here and in every child: the matrices are tiny, and every session has its own
# process. NumPy reads it once, when it is imported, so it stands before every other import.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
