"""A scene: a robot, a hierarchy of tasks with their references, and timed events.

himpc-lab run FILE.py
himpc-lab --scene FILE.py
"""

from dataclasses import replace

import numpy as np

from himpc.references import Circle, Phase
from lessons import load_scene
from lessons.events import Push

# Start from an existing scene (himpc-lab scenes lists them) and change its fields.
START = load_scene("planar3-hold")


def references(robot, stack):
    """Returns the desired motions by task name; every other task gets a target that can be dragged."""
    # Half a turn per second on a circle of 5 cm; the motion begins at the hand's position, (0.6, 0.3) m.
    centre, radius = np.array([0.55, 0.3]), 0.05
    u, w = np.array([radius, 0.0]), np.array([0.0, radius])
    return {"position": Circle(centre, u, w, Phase(np.pi, "eased"))}


SCENE = replace(
    START,
    title="A small circle, and a push",
    # Any setting of himpc-lab run --set.
    settings=START.settings.changed("horizon", 10).changed("limits.torque_scale", 0.5),
    references=references,
    q_0=np.deg2rad([0.0, 90.0, -90.0]),
    # Events of lessons.events with their times, s.
    events=((1.0, Push("link_3", force=(0.0, 5.0, 0.0), seconds=0.1)),),
    duration=4.0,
)
