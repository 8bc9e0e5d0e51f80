"""The page: one simulation process per browser, the 3D view and the panels. No other package imports viser.

The path of a dragged target from the browser to the tick:
1. The browser sends the pose of the gizmo. `web/guard` counts the bytes, `web/inlet` refuses values that
   a control cannot have, and viser calls back on its loop, in `view/targets`.
2. `view/drag`, on a thread of its own, computes the nearest pose that the robot can reach, and posts a
   `MoveTarget`.
3. `client/simulation_client` puts the message into the outbox of `link/process`, which never waits. A thread
   sends it.
4. `worker/main` reads the message and passes it to `worker/simulation`, which puts it into the session's
   mailbox.
5. The session (`lessons/session/session.py`) empties its mailbox when the next tick begins.

The path of a row of telemetry from the tick to the browser:
1. A tick of the session returns the row; `worker/simulation` writes it into the shared memory of `link/ring`.
2. The page's thread (`page/page`, 30 Hz) gets the time to show from `client/moment`, which reads the new
   rows.
3. `client/recording` keeps the minimum and the maximum of each column in each interval of time, and a hundred
   rows per second exactly.
4. `page/scene_view` gives the moment to `page/torque` or `page/velocity`, which draws the panels' curves.
5. viser sends the changes. Data that need not be sent every tick (settings, notices, the progress of a
   lesson) are sent ten times a second as a `Status` over `link/process`; `client/simulation` receives
   them.
"""

import os

# One thread per matrix product, here and in every child, as the matrices are tiny and every session has its
# own process. NumPy reads these variables when it is imported, so this line precedes every other import.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
