"""The first line of a request. websockets reads only GET in HTTP/1.1; monitors also use HEAD and HTTP/1.0."""

from __future__ import annotations

import re
from dataclasses import dataclass
from http import HTTPStatus
from urllib.parse import urlsplit

from app.server.door import Answer
from app.server.load import PATHS

_LINE = re.compile(rb"([A-Z]{1,20}) ([^\s]+) HTTP/1\.([01])(?=\r\n)")
_READ = ("GET", "HEAD")
NOT_ALLOWED = Answer(
    HTTPStatus.METHOD_NOT_ALLOWED,
    "This request is not supported",
    "<p>This server answers GET and HEAD only.</p>",
    (("Allow", ", ".join(_READ)),),
)
_TOO_OLD = Answer(
    HTTPStatus.HTTP_VERSION_NOT_SUPPORTED,
    "HTTP/1.1 is needed",
    "<p>In HTTP/1.0 this server answers only /health and /metrics. In a proxy, switch on HTTP/1.1; in nginx "
    "with <code>proxy_http_version 1.1;</code>.</p>",
)


@dataclass(frozen=True)
class RequestLine:
    """Method and path of a request. is_old: whether it is in HTTP/1.0. A line that cannot be read has the
    method ""."""

    method: str = ""
    path: str = ""
    is_old: bool = False

    @property
    def refusal(self) -> Answer | None:
        """The response to a request that is not supported; None for every other request."""
        if self.method not in (*_READ, ""):
            return NOT_ALLOWED
        return _TOO_OLD if self.is_old and urlsplit(self.path).path not in PATHS else None


def request_line(data: bytes) -> tuple[RequestLine, bytes]:
    """Returns the first line of `data`, and the data with GET and HTTP/1.1 in this line. If the line cannot
    be read, the data are unchanged, and websockets refuses them."""
    found = _LINE.match(data)
    if found is None:
        return RequestLine(), data
    method, path, version = found[1].decode(), found[2], found[3]
    line = RequestLine(method, path.decode("ascii", "surrogateescape"), version == b"0")
    return line, b"GET " + path + b" HTTP/1.1" + data[found.end() :]
