"""What is refused to a learner, in sentences."""

from __future__ import annotations

STAYING = "Your teacher keeps the class at this step: wait for the next one."
WAITING = "Your teacher runs this step for everybody: say what you expect, and wait."
ARM_AGAIN = "An arm is driven once: end this program and start himpc-lab arm again."
ARM_GHOST = "The ghost of an arm is its simulation, which gets the same targets: there is no other one."
