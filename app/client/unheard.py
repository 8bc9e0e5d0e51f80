"""A request for a scene that the simulation has not answered yet."""

from __future__ import annotations

from typing import NamedTuple

from app.link.choice import SceneChoice
from app.link.messages import Loading, LoadRefused, Ready, Report, Status


class Unheard(NamedTuple):
    """The scene (None: the present one), and the number of resets when it was requested."""

    choice: SceneChoice | None
    resets: int

    def after(self, report: Report) -> Unheard | None:
        """Returns None if the report answers this request, else this request."""
        match report:
            case Status(resets=resets) if resets != self.resets:
                return None
            case Loading() | Ready() | LoadRefused():
                return None
            case _:
                return self
