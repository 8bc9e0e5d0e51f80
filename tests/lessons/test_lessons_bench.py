"""The benchmark of control steps compares himpc and himpc_printed with every solver on the same scenes."""

from __future__ import annotations

import pytest

from lessons.experiments.bench import SCENES, bench, ratios


@pytest.mark.parametrize("scene", SCENES)
def test_every_solver_is_timed_on_every_scene(scene: str) -> None:
    timings = bench(scene, horizons=(2,), ticks=10)
    assert {("himpc", "daqp"), ("himpc_printed", "daqp"), ("himpc_printed", "proxqp")} <= {
        (timing.controller, timing.solver) for timing in timings
    }
    assert all(timing.ticks >= 10 and timing.step_ms["median"] > 0.0 for timing in timings)
    assert ratios(timings)["2"]["printed_daqp_over_compiled"] > 0.0
