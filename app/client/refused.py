"""The messages for a learner's commands that are refused."""

from __future__ import annotations

STAYING = "Your teacher keeps the class at this step: wait for the next one."
WAITING = "Your teacher runs this step for everybody: say what you expect, and wait."
ARM_AGAIN = "Each start of himpc-lab arm drives the arm once: end this program and start it again."
ARM_GHOST = "On this page the ghost is always the simulation of the arm, which gets the same targets."
