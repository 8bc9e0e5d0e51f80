"""A notification about an error in the user's own code. It is visible however far the panel is scrolled, and
above the sheet of a phone."""

from __future__ import annotations

import viser


class FaultNotice:
    """A notification at the top of the page until the code is corrected or the learner closes it."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._said: str | None = None
        self._shown: viser.NotificationHandle | None = None

    def show(self, sentence: str | None) -> None:
        """Shows the sentence of a fault; None removes the notification."""
        if sentence == self._said:
            return
        self._said = sentence
        # Replaced, not updated: a notification that the learner closed would stay closed and hide the new
        # fault.
        if self._shown is not None:
            self._shown.remove()
        self._shown = None
        if sentence is not None:
            self._shown = self._client.add_notification("Your code", sentence, color="red")
