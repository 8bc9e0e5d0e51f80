"""A fault of one's own code in sight wherever the panel is scrolled to, and on a phone above its sheet."""

from __future__ import annotations

import viser


class FaultNotice:
    """At the top of the page, until the code is mended or the learner closes it."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._said: str | None = None
        self._shown: viser.NotificationHandle | None = None

    def show(self, sentence: str | None) -> None:
        """The fault, or None if there is none."""
        if sentence == self._said:
            return
        self._said = sentence
        # Not updated: one that was closed would stay so, and the new fault unseen.
        if self._shown is not None:
            self._shown.remove()
        self._shown = None
        if sentence is not None:
            self._shown = self._client.add_notification("Your code", sentence, color="red")
