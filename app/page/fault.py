"""A notification about an error in a file of the user. It stays visible when the panel is scrolled, and
appears above the sheet on a phone."""

from __future__ import annotations

import viser


class FaultNotice:
    """A notification at the top of the page. It stays until the code is corrected or the learner closes the
    notification."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._said: str | None = None
        self._shown: viser.NotificationHandle | None = None

    def show(self, sentence: str | None) -> None:
        """Shows the sentence of a fault; None removes the notification."""
        if sentence == self._said:
            return
        self._said = sentence
        # The notification is replaced, not updated. A closed notification would stay closed, and the new
        # fault would not be shown.
        if self._shown is not None:
            self._shown.remove()
        self._shown = None
        if sentence is not None:
            self._shown = self._client.add_notification("Your file", sentence, color="red")
