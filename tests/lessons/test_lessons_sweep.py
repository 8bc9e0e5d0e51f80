"""A sweep runs the requested cells. If it is stopped and resumed, its result is that of a sweep without a
stop."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lessons.cluster import on_cluster
from lessons.experiments.sweep import (
    Cell,
    best_cell,
    carry_on,
    check_metric,
    draw_sweep,
    finished_cells,
    make_sweep,
    metrics,
)
from lessons.parallel import FailedJob, cores, on_cores, one_by_one
from lessons.plots.heat import SweepMap, draw_map
from lessons.scenes.run_spec import RunSpec
from robots import InputError

SHORT = RunSpec("planar3-circle", duration=0.02)
OVER = ("M_bar_scale=0.5:2:2", "horizon=1:3:3")


@pytest.mark.parametrize(
    ("over", "values", "log"),
    [
        ("M_bar_scale=0.2:4:3", (0.2, 0.894427191, 4.0), True),
        ("M_bar_scale=0.2:4:3:lin", (0.2, 2.1, 4.0), False),
        ("M_bar_scale=1:3:3", (1.0, 2.0, 3.0), False),
        ("horizon=1:30:3", (1, 16, 30), False),
        ("horizon=5:5:1", (5,), False),
        ("plant.payload_kg=0:2:3", (0.0, 1.0, 2.0), False),
        ("T_s=0.001:0.001:1", (0.001,), False),
    ],
)
def test_a_range_becomes_values(over: str, values: tuple[float, ...], log: bool) -> None:
    """Values have equal ratios over a decade or more and equal steps over a smaller range; they are integers
    if the setting requires it."""
    (axis,) = make_sweep(SHORT, [over]).axes
    assert axis.values == pytest.approx(values)
    assert axis.log is log
    assert [type(value) for value in axis.values] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("over", "says"),
    [
        ((), "--over"),
        (("M_bar_scale",), "PATH=lo:hi:n"),
        (("M_bar_scale=1:2",), "PATH=lo:hi:n"),
        (("M_bar_scale=1:nan:3",), "PATH=lo:hi:n"),
        (("M_bar_scale=2:1:3",), "lo < hi"),
        (("M_bar_scale=1:2:0",), "n of 1"),
        (("M_bar_scal=1:2:3",), "M_bar_scale"),
        (("M_bar_scale=-1:2:3",), "M_bar_scale"),
        (("plant.payload_kg=0:2:3:log",), "lin"),
        (("horizon=1:3:9",), "whole numbers"),
        (("horizon=1:99:3",), "horizon"),
        (("horizon=1:3:3", "horizon=1:2:2"), "twice"),
        (("M_bar_scale=1:2:1000", "R=1:2:1000"), "cells"),
        (("M_bar_scale=1:2:1000000000000000",), "at most 100000"),
    ],
)
def test_a_wrong_range_is_one_sentence(over: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        make_sweep(SHORT, over)


def test_cells_run_what_their_place_says() -> None:
    """The values of the last axis change fastest, and the job of each cell adds the values of the cell to
    those of the base."""
    sweep = make_sweep(RunSpec("planar3-circle", set=("Q=100",)), OVER)
    assert sweep.points == [(m, n) for m in (0.5, 2.0) for n in (1, 2, 3)]
    assert sweep.run(4).set == ("Q=100", "M_bar_scale=2.0", "horizon=2")


class Stop(Exception):
    """An exception that represents Ctrl-C of a user."""


def stopping_after(count: int) -> Callable[..., Generator[tuple[int, Any], None, None]]:
    """Returns a function that runs `count` items in reverse order and then stops."""

    def spread(
        function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        for done, place in enumerate(reversed(range(len(items)))):
            if done == count:
                raise Stop
            yield place, function(items[place])

    return spread


def test_a_stopped_sweep_goes_on_to_the_same_result(tmp_path: Path) -> None:
    """A sweep is stopped half-way, with an incomplete last line, and resumed; its results.json is bitwise
    equal to that of a sweep without a stop."""
    sweep = make_sweep(SHORT, OVER)
    carry_on(sweep, tmp_path / "whole", one_by_one)
    part = tmp_path / "part"
    with pytest.raises(Stop):
        carry_on(sweep, part, stopping_after(3))
    with (part / "cells.jsonl").open("a") as file:
        file.write('{"index": 0, "summ')
    assert sorted(finished_cells(sweep, part)) == [3, 4, 5]
    ran: list[int] = []

    def counting(
        function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        ran.append(len(items))
        yield from one_by_one(function, items)

    carry_on(sweep, part, counting)
    assert ran == [3]
    assert (part / "results.json").read_bytes() == (tmp_path / "whole" / "results.json").read_bytes()
    carry_on(sweep, part, counting)
    assert ran == [3, 0]


def test_all_cores_give_the_same_result_as_one(tmp_path: Path) -> None:
    """Spawned processes and this process write the same file, in whatever order the cells are completed."""
    sweep = make_sweep(SHORT, ("M_bar_scale=0.5:2:3",))
    for name, spread in (("one", one_by_one), ("all", on_cores)):
        carry_on(sweep, tmp_path / name, spread)
    assert (tmp_path / "one/results.json").read_bytes() == (tmp_path / "all/results.json").read_bytes()


def test_another_sweep_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    """The sentence names the difference, and the folder keeps its content."""
    sweep = make_sweep(SHORT, ("M_bar_scale=1:2:2",))
    carry_on(sweep, tmp_path, one_by_one)
    held = (tmp_path / "cells.jsonl").read_bytes()
    for other in (
        make_sweep(SHORT, ("M_bar_scale=1:3:2",)),
        make_sweep(RunSpec("planar3-circle", controller="hiqp", duration=0.02), ("M_bar_scale=1:2:2",)),
    ):
        with pytest.raises(InputError, match=r"another sweep \((over|controller) differ"):
            carry_on(other, tmp_path, one_by_one)
    assert (tmp_path / "cells.jsonl").read_bytes() == held


def fails_at_two(value: int) -> int:
    """A job that fails for one value."""
    if value == 2:
        raise InputError("two is too many")
    return value * value


def dies_at_one(value: int) -> int:
    """A job that ends its process for one value."""
    if value == 1:
        os._exit(1)
    return value * value


def test_a_sweep_notices_that_a_file_of_ones_own_was_changed(tmp_path: Path) -> None:
    """A file that changes between two calls, or during one, is detected, because a map must not mix cells of
    two versions."""
    file, out = tmp_path / "mine.py", tmp_path / "out"
    file.write_text("def torque(now):\n    return now.bias\n")
    base = RunSpec("planar3-circle", controller=str(file), duration=0.02)
    sweep = make_sweep(base, OVER[:1])
    carry_on(sweep, out, one_by_one)
    file.write_text("def torque(now):\n    return 2 * now.bias\n")
    with pytest.raises(InputError, match=r"another sweep \(files differ"):
        carry_on(sweep, out, one_by_one)

    def saved_meanwhile(function: Any, items: Any) -> Generator[tuple[int, Any], None, None]:
        outcomes = one_by_one(function, items)
        yield next(outcomes)
        file.write_text("def torque(now):\n    return 3 * now.bias\n")
        yield from outcomes

    with pytest.raises(InputError, match=r"mine\.py@\w+: was changed during the sweep"):
        carry_on(sweep, tmp_path / "other", saved_meanwhile)


@pytest.mark.parametrize("spread", [one_by_one, on_cores])
def test_failed_work_is_an_outcome(spread: Callable[..., Generator[tuple[int, Any], None, None]]) -> None:
    assert dict(spread(fails_at_two, [1, 2, 4])) == {0: 1, 1: FailedJob("two is too many"), 2: 16}


def test_a_process_that_dies_costs_its_own_item_only() -> None:
    outcomes = dict(on_cores(dies_at_one, [0, 1, 2, 3]))
    assert [outcomes[place] for place in (0, 2, 3)] == [0, 4, 9]
    assert isinstance(outcomes[1], FailedJob)
    assert "process ended" in outcomes[1].reason


def dies_once(item: tuple[Path, int]) -> tuple[int, int]:
    """A job whose first attempt at 1 ends its process."""
    marker, value = item
    if value == 1 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return value, os.getpid()


def test_a_process_that_dies_once_costs_a_retry(tmp_path: Path) -> None:
    """Every item has its result, and only the items that were running at that moment are repeated, in
    separate processes."""
    outcomes = dict(on_cores(dies_once, [(tmp_path / "died", value) for value in range(12)]))
    done = {place: outcome for place, outcome in outcomes.items() if not isinstance(outcome, FailedJob)}
    assert {place: value for place, (value, _) in done.items()} == {value: value for value in range(12)}
    assert len({pid for _, pid in done.values()}) <= 3 * cores()


def test_a_run_that_fails_or_loses_control_is_a_cell(tmp_path: Path) -> None:
    """A run with a much too large M̄ loses control, and another run fails for a reason. Both are in the file,
    without a value."""
    unbounded = ("plant.saturate=false", "limits.torque=false", "limits.velocity=false")
    sweep = make_sweep(RunSpec("planar3-circle", set=unbounded, duration=0.3), ("M_bar_scale=1:200:2",))

    def one_failing(
        function: Callable[[Any], Any], items: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        yield 0, FailedJob("no reason")
        yield 1, function(items[1])

    cells = carry_on(sweep, tmp_path, one_failing)
    assert [cell.error for cell in cells] == ["no reason", None]
    assert [cell.diverged for cell in cells] == [False, True]
    assert all(np.isnan(cell.value("tasks.position.rmse")) for cell in cells)
    assert best_cell(cells, "tasks.position.rmse") is None
    written = json.loads((tmp_path / "results.json").read_text())
    assert [cell["error"] for cell in written["cells"]] == ["no reason", None]
    assert written["cells"][1]["summary"]["diverged"] is True


def test_metrics_are_the_numbers_of_a_run() -> None:
    """Level 1 is the default, coordinates are combined, and for an unknown metric the nearest name is
    suggested."""
    names = metrics(make_sweep(SHORT, OVER))
    assert names[0] == "tasks.position.rmse"
    assert metrics(make_sweep(RunSpec("planar3-circle"), OVER))[0] == "tasks.position.rmse_after_1s"
    assert {"limits.torque.max_ratio", "average_cost.2", "solver.unsolved"} <= set(names)
    with pytest.raises(InputError, match=r"limits\.torque\.max_ratio"):
        check_metric("limits.torqe.max_ratio", names)
    summary = {"diverged": False, "tasks": [{"name": "position", "rmse": [3.0, 4.0]}]}
    assert Cell(0, summary, None).value("tasks.position.rmse") == 5.0


@pytest.mark.parametrize("over", [OVER, OVER[:1]])
def test_one_or_two_paths_make_a_picture(tmp_path: Path, over: tuple[str, ...]) -> None:
    sweep = make_sweep(SHORT, over)
    cells = carry_on(sweep, tmp_path, one_by_one)
    path = draw_sweep(sweep, cells, "tasks.position.rmse", tmp_path)
    assert path is not None
    assert path.read_bytes().startswith(b"\x89PNG")


def test_three_paths_make_none(tmp_path: Path) -> None:
    sweep = make_sweep(SHORT, (*OVER, "Q=1:2:1"))
    assert draw_sweep(sweep, [], "tasks.position.rmse", tmp_path) is None


def test_a_map_without_a_single_value_can_be_drawn(tmp_path: Path) -> None:
    """If every run of a map lost control, the map is hatched and has no colour scale."""
    nothing = np.full((2, 2), np.nan)
    lost = np.array([[True, True], [False, True]])
    path = tmp_path / "map.png"
    swept = SweepMap("t", "m", ("a", "b"), ((1, 2), (1, 2)), (False, True), nothing, lost, ~lost)
    draw_map(path, swept)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="cluster"), on_cluster("tcp://127.0.0.1:1"):
        pass


def test_a_scheduler_that_is_not_there_is_one_sentence() -> None:
    with pytest.raises(InputError, match=r"--scheduler"), on_cluster("tcp://127.0.0.1:1"):
        pass
