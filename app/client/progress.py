"""The progress of the learner at a page."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

from lessons.replay.progress import HandedIn, LearnerProgress, kept, written


class Notebook:
    """The progress of the learner at this page. The browser stores it whenever it grows."""

    def __init__(
        self,
        progress: LearnerProgress,
        save: Callable[[str], None],
        key: bytes | None = None,
        account: str = "",
    ) -> None:
        """key: the lab's key, which signs the progress; account: the name with which the learner signed
        in."""
        self.progress, self.account = progress, account
        self._save, self._key = save, key

    @property
    def signs(self) -> bool:
        return self._key is not None

    def note(self, progress: LearnerProgress) -> None:
        if progress != self.progress:
            self.progress = progress
            self._save(kept(progress, self._key, self.account))

    def to_hand_in(self, name: str, code: str) -> str:
        """Returns the progress so far as a text that can be handed in. code: state code of the setting on the
        page."""
        now = datetime.now(UTC).isoformat(timespec="seconds")
        return written(HandedIn(name, now, self.progress, code, self.account), self._key)
