"""Opens the page in the browser of the person who started the server."""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from html import escape
from pathlib import Path

_LEADING = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0; url={0}"><title>himpc-lab</title>'
    '<p><a href="{0}">Open himpc-lab</a></p></html>'
)


@contextlib.contextmanager
def opened_in_a_browser(link: str) -> Iterator[None]:
    """Opens the link in a browser. Every user of the machine can see the arguments of a program, but the link
    is secret. The browser therefore first loads a temporary file that leads to the link. Only this user may
    read the file, and it is deleted afterwards."""
    with tempfile.TemporaryDirectory(prefix="himpc-lab-", ignore_cleanup_errors=True) as folder:  # mode 0700
        file = Path(folder) / "open.html"
        with open(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="utf-8") as text:
            text.write(_LEADING.format(escape(link)))
        threading.Thread(target=webbrowser.open, args=(file.as_uri(),), daemon=True).start()
        yield
