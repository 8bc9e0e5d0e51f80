"""The browser tab of a page, and what is known of the person at it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import viser

from app.tab.comfort import Comfort
from lessons.own.files import Folder
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


@dataclass(frozen=True, eq=False)
class Visitor:
    """What stays the same for a page whatever it shows.

    Attributes:
        client: the browser tab.
        loop: viser's event loop.
        own_files: the folder whose files this page may name; None if it may name no files.
        notebook: the learner's progress.
        comfort: the theme, and help for people who need it.
    """

    client: viser.ClientHandle
    loop: asyncio.AbstractEventLoop
    own_files: Folder | None
    notebook: Notebook
    comfort: Comfort
