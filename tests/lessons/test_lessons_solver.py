"""Controllers that have a QP solver use `solver` and report the solver that ran; controllers without one
refuse it."""

from __future__ import annotations

from typing import Any

import pytest

from himpc import qp
from himpc.catalog import CONTROLLERS, OWN_METHOD
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec
from robots import InputError

QPS = ("himpc", "hiqp", "nhimpc", "weighted")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The names of the QP solvers that were called."""
    found: set[str] = set()

    def noted(name: str, attempt: Any) -> Any:
        def call(*args: Any, **kwargs: Any) -> Any:
            found.add(name)
            return attempt(*args, **kwargs)

        return call

    attempts = {name: tuple(noted(name, each) for each in those) for name, those in qp._ATTEMPTS.items()}
    monkeypatch.setattr(qp, "_ATTEMPTS", attempts)
    return found


@pytest.mark.parametrize(
    ("scene", "controller", "settings", "told"),
    [
        *(("planar3-circle", each, (), OWN_METHOD) for each in QPS),
        ("planar3-circle", "himpc_printed", (), "daqp"),
        ("planar3-circle", "himpc_printed", ("solver=proxqp",), "proxqp"),
        ("planar3-circle", "hqp", (), "daqp"),
        ("planar3-circle", "hqp", ("solver=proxqp",), "proxqp"),
        ("planar3-circle", "osf", (), None),
        ("iiwa14-htmpc", "htmpc", (), OWN_METHOD),
        ("iiwa14-htmpc", "htmpc", ("solver=proxqp",), "proxqp"),
        ("iiwa14-htmpc", "htidkc", (), "daqp"),
        ("iiwa14-htmpc", "htidkc", ("solver=proxqp",), "proxqp"),
        ("iiwa14-htmpc", "placo", (), "placo"),
    ],
)
def test_the_reported_solver_is_the_one_that_ran(
    scene: str, controller: str, settings: tuple[str, ...], told: str | None, asked: set[str]
) -> None:
    scaled = ("limits.velocity_scale=0.2",)  # so that bounds are active
    spec = RunSpec(scene, controller=controller, set=(*scaled, *settings), duration=0.1)
    found = summary(run(spec.prepared()))["solver"]
    assert found["backend"] == told and found["fallbacks"] == {}
    assert asked == {told} - {OWN_METHOD, "placo", None}


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_solver_that_changes_nothing_is_refused(controller: str) -> None:
    spec = RunSpec("planar3-circle", controller=controller, set=("solver=proxqp",), duration=0.003)
    if controller in ("hqp", "himpc_printed"):
        run(spec.prepared())
        return
    with pytest.raises(InputError, match=r"solver=proxqp changes nothing here.*himpc_printed.*solver=daqp"):
        run(spec.prepared())
