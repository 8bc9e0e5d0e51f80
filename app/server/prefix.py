"""Serves the page below a path of another site.

viser's page opens its web socket at its own address without the slash at the end. A proxy that serves the
page below a path redirects this address to the address with the slash, but browsers do not follow redirects
of web sockets. Therefore the page has a name (`NAME`) below a path, and its address has no slash at the end.
viser's page then also writes the address of its web socket into its own address, and a reload sends this
parameter. It could name another server, and is removed.
"""

from __future__ import annotations

from http import HTTPStatus
from urllib.parse import urlencode, urlsplit

from websockets.http11 import Request

from app.server.door import ELSEWHERE, NAME, Answer, query_of

PREFIX = "X-Forwarded-Prefix"
"""The header in which a proxy, e.g. jupyter-server-proxy, sends the path that it removed."""


def under_its_name(request: Request) -> Answer | None:
    """Changes a request for the page's name so that it opens the page. Returns a redirect to this name if the
    request is for the folder below a path or names another server, else None."""
    parts, given = urlsplit(request.path), query_of(request)
    rest = urlencode({name: values for name, values in given.items() if name not in ELSEWHERE}, True)
    query = f"?{rest}" if rest else ""
    named = parts.path == f"/{NAME}"
    if named and ELSEWHERE.isdisjoint(given):
        request.path = f"/{query}"
    elif named or (parts.path == "/" and any(each.strip("/") for each in request.headers.get_all(PREFIX))):
        link = (("Location", f"./{NAME}{query}"), ("Cache-Control", "no-store"))
        return Answer(HTTPStatus.SEE_OTHER, "himpc-lab", "Opening …", link)
    return None
