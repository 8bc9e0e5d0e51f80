"""A session compiles nothing during a run."""

from __future__ import annotations

from himpc.catalog import CONTROLLERS
from himpc.compilation.compiled import on_compiled
from himpc.compilation.compiling import compile_all
from lessons.events import Set
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


def test_no_setting_compiles_in_the_middle_of_a_run() -> None:
    """Other horizons, levels, weights and controllers use functions that are already compiled."""
    compile_all(lambda *_: None)
    session = TorqueSession(torque_scene("iiwa14-hold"), seed=0)
    late: list[str] = []
    changes = [
        *(Set("horizon", 8), Set("levels.1.Q", (100.0, 200.0, 300.0)), Set("R", 3.0)),
        *(Set(f"levels.{level}.enabled", on) for level, on in ((2, False), (1, False), (2, True), (1, True))),
        *(Set("controller", name) for name in CONTROLLERS),
        Set("controller", "himpc"),
    ]
    with on_compiled(late.append):
        for change in changes:
            session.post(change)
            for _ in range(3):
                session.tick()
    assert not session.notices
    assert not late
