"""The command line with velocity-level scenes: the documented HTMPC keys, and one sentence per error."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main

SQUARE = "ridgeback-ur10-square"


def test_run_prints_the_contract_of_a_velocity_level_scene(tmp_path: Path) -> None:
    """In addition, the result has the keys of parts, line search, base path and mission. The npz file has one
    row per tick."""
    out, rows = tmp_path / "out.json", tmp_path / "rows.npz"
    assert main(["run", SQUARE, "--duration", "1", "--json", str(out), "--npz", str(rows)]) == 0
    result = json.loads(out.read_text())
    assert result["controller"] == "htmpc"
    assert result["limits"]["torque"] == {"max_ratio": None, "applied_max_ratio": None}
    assert set(result["limits"]) == {"torque", "velocity", "position", "acceleration", "jerk"}
    assert [part["name"] for part in result["parts"]] == ["peak", "valley"]
    assert set(result["parts"][0]["ee_error_mm"]) == {"mean", "std", "max"}
    assert result["parts"][1]["normalised_base_error"] is None, "the run ended before it"
    assert set(result["line_search"]) == {"mean_step", "zero_share"}
    assert result["base_path_m"] >= 0.0
    assert (result["completed"], result["completion_time_s"]) == (False, None)
    with np.load(rows) as arrays:
        assert len(arrays["t"]) == 10
        settings = json.loads(str(arrays["settings"]))
    assert (settings["scene"], settings["seed"]) == (SQUARE, 0)


def test_run_shows_people_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    """The table shows the motion of the hand and of the base."""
    assert main(["run", SQUARE, "--duration", "1", "--controller", "htmpc_wpt"]) == 0
    shown = capsys.readouterr().out
    assert "way of the base" in shown
    assert "peak" in shown
