"""The learners' pages, which show the state of the class."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

from app.classes.gathering import Gathering
from app.classes.views import View, for_all


class Seats:
    """Stores, for each learner's page, the function that shows a view and the view that is shown now."""

    def __init__(self, vote: str) -> None:
        """vote: the page on which watchers vote; "" if learners have robots of their own."""
        self._vote = vote
        self._lock = threading.Lock()
        self._seats: dict[str, tuple[Callable[[View], object], View | None]] = {}

    def sit(self, who: str, show: Callable[[View], object]) -> None:
        """Shows the class on a learner's page from now on. show: called with the view whenever the view
        changes."""
        with self._lock:
            self._seats[who] = show, None

    def rise(self, who: str) -> None:
        """Called when a learner's page was closed."""
        with self._lock:
            self._seats.pop(who, None)

    def show(self, state: Gathering, before: Mapping[str, int]) -> None:
        """Updates all pages whose view has changed. before: for each learner who waits for a robot at the
        class's step, the number of learners before them."""
        with self._lock:
            seats = list(self._seats.items())
        everybody = for_all(state)
        for who, (show, shown) in seats:
            member = state.members.get(who)
            away = member is not None and state.place not in (None, member.at) and who not in before
            more = {"vote": self._vote, "before": before.get(who)}
            view = {**everybody, "voted": 0, "away": away, **more}
            if view == shown:
                continue
            try:
                show(view)
            except Exception:
                continue  # the page is being rebuilt, or was closed
            with self._lock:
                if who in self._seats and self._seats[who][0] is show:
                    self._seats[who] = show, view
