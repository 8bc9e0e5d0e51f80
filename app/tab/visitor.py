"""The browser tab of a page, and what is known of the person at it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import viser

from app.client.progress import Notebook
from app.tab.comfort import Comfort
from lessons.own.files import Folder


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
