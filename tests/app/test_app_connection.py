"""Reports bring the open file of their shared memory along."""

from __future__ import annotations

import multiprocessing
import os
from typing import Any

import pytest

from app.link.choice import SceneChoice
from app.link.process import hang_up, receive
from app.worker.simulation import SimulationRunner
from lessons.scenes.run_spec import RunSpec


def test_a_report_that_breaks_off_leaves_no_open_file() -> None:
    body = SimulationRunner(SceneChoice(RunSpec("planar3-hold")))
    ends: tuple[Any, Any] = multiprocessing.Pipe()
    here, there = ends
    before = len(os.listdir("/proc/self/fd"))
    try:
        there.send(body.ready())  # the file does not follow
        hang_up(there)
        with pytest.raises(OSError, match="did not arrive"):
            receive(here)
        assert len(os.listdir("/proc/self/fd")) == before
    finally:
        body.close()
        here.close()
        there.close()
