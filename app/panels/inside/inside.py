"""The tab that shows one tick: its pictures, and its requests for data from the simulation."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from app.client.moment import Moment
from app.html.text import block
from app.link.messages import Inside, InsideRequest, Status
from app.panels.inside.matrix import MatrixPanel, SpectrumPicture
from app.panels.inside.plane import PlanePanel
from app.tab.context import PageContext
from lessons.settings.torque import TorqueSettings

_AGAIN = 0.4
"""Time, s, after which an unanswered request is sent again. A simulation that was restarted has lost the
request."""


class InsideSubscription:
    """Sends the request when it changes, and again while it is not answered."""

    def __init__(self, send: Callable[[InsideRequest], None]) -> None:
        self._send = send
        self._wish, self._sent_at = InsideRequest(), 0.0

    def ask(self, wish: InsideRequest, heard: Inside | None) -> None:
        """heard: the simulation's last answer."""
        now = time.monotonic()
        mute = wish != InsideRequest() and heard is None and now - self._sent_at > _AGAIN
        if wish != self._wish or mute:
            self._wish, self._sent_at = wish, now
            self._send(wish)


class InsidePanel:
    """The tab *Inside*. It requests only the data of pictures that the browser shows."""

    def __init__(self, page: PageContext, spectrum: SpectrumPicture) -> None:
        """spectrum: the picture beside the controls of M̄."""
        gui, levels = page.gui, tuple(dict.fromkeys(task.level for task in page.ready.tasks))
        self._plane: PlanePanel | None = None
        if page.robot.n > 1:
            self._plane = PlanePanel(page, levels)
        else:
            gui.add_html(block("This robot has one joint with one Δτ; the plane needs two."))
        with gui.add_folder("The Hessian", expand_by_default=False):
            self._matrix = MatrixPanel(page, levels)
        self._spectrum = spectrum
        self._watching = InsideSubscription(page.send)

    def draw(self, moment: Moment) -> None:
        """Draws the data of an instant, and requests the data for the next one."""
        plane = InsideRequest() if self._plane is None else self._plane.wish
        wish: InsideRequest = replace(plane, matrix=self._matrix.wish, spectrum=self._spectrum.in_view)
        self._watching.ask(wish, moment.status.inside)
        if self._plane is not None:
            self._plane.draw(moment)
        self._matrix.draw(moment.status.inside)
        self._spectrum.draw(moment.status.inside)

    def write(self, status: Status, settings: TorqueSettings) -> None:
        if self._plane is not None:
            self._plane.write(status.inside, settings)
        self._matrix.write(status.inside)
