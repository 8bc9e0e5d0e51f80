"""The messages for a learner's commands that are refused."""

from __future__ import annotations

STAYING = "Your teacher keeps the class at this step: wait for the next one."
WAITING = "Your teacher runs this step for everybody: say what you expect, and wait."
