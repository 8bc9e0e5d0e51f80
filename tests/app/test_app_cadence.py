"""How often a page is updated: in real time, in slowed time, and while its robot stands still."""

from __future__ import annotations

from app.page.page import CALM, LEAST, PLOTS, POSES, STILL, TEXTS, Cadence


def looks(cadence: Cadence, begin: float, end: float, moves: bool, pace: float) -> tuple[float, float, float]:
    """Returns the numbers of looks, plots and texts per second."""
    now, seen = begin, [0, 0, 0]
    while now < end:
        seen[0] += 1
        seen[1] += cadence.plots_due(now)
        seen[2] += cadence.texts_due(now)
        now += cadence.shown(now if moves else "here", pace, now)
    return seen[0] / (end - begin), seen[1] / (end - begin), seen[2] / (end - begin)


def test_a_page_is_updated_as_often_as_something_moves() -> None:
    cadence = Cadence()
    fast = looks(cadence, 0.0, 10.0, moves=True, pace=1.0)
    assert abs(fast[0] - POSES) < 0.5 and abs(fast[1] - PLOTS) < 0.5 and abs(fast[2] - TEXTS) < 0.5
    slowed = looks(cadence, 10.0, 20.0, moves=True, pace=0.1)
    assert abs(slowed[0] - LEAST * POSES) < 0.5 and abs(slowed[1] - LEAST * PLOTS) < 0.5
    assert slowed[2] > 0.8 * TEXTS, "texts come as soon in slowed time"
    looks(cadence, 20.0, 20.0 + 2 * STILL, moves=False, pace=1.0)
    still = looks(cadence, 30.0, 40.0, moves=False, pace=1.0)
    assert all(abs(rate - CALM) < 0.5 for rate in still)
    again = looks(cadence, 40.0, 50.0, moves=True, pace=1.0)
    assert abs(again[0] - POSES) < 0.5, "and as soon as it moves, as often as before"
