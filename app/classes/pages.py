"""The two pages of a class as HTML: the teacher's and the phones'. They use no library, load no other files,
and run only their own script."""

from __future__ import annotations

import base64
import hashlib
import io
from functools import cache, lru_cache
from importlib.resources import files
from typing import Literal

import segno

PageName = Literal["phone", "teacher"]


@cache
def page(name: PageName) -> str:
    return _file(f"{name}.html").replace("/*style*/", _style(name)).replace("/*script*/", _script(name))


def policy(name: PageName, host: str) -> str:
    """Returns the page's Content-Security-Policy. host: the server's name in the browser's request, for
    browsers in which 'self' does not include web sockets."""
    return (
        f"default-src 'none'; script-src '{_digest(_script(name))}'; style-src '{_digest(_style(name))}'; "
        f"connect-src 'self' ws://{host} wss://{host}; frame-ancestors 'none'; base-uri 'none'; "
        "form-action 'none'"
    )


@lru_cache(maxsize=16)
def qr(address: str) -> str:
    drawn = io.BytesIO()
    segno.make(address, error="m").save(
        drawn, kind="svg", xmldecl=False, svgns=True, omitsize=True, border=2, light="#fff"
    )
    return drawn.getvalue().decode()


def _style(name: PageName) -> str:
    return _file("class.css") + _file(f"{name}.css")


def _script(name: PageName) -> str:
    return "".join(_file(each) for each in ("robot.js", "class.js", f"{name}.js"))


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


@cache
def _file(name: str) -> str:
    return (files("app.classes") / "web" / name).read_text(encoding="utf-8")
