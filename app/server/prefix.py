"""The page below a path of another site.

viser's page opens its web socket at its own address without the slash at the end. A proxy that serves it
below a path redirects such an address to the one with the slash, and browsers do not follow redirects of web
sockets. So below a path the page has a name. viser's page then also puts the address of its web socket into
its own address, which a reload sends; it could be another server's, so it is taken out again.
"""

from __future__ import annotations

from http import HTTPStatus
from urllib.parse import urlencode, urlsplit

from websockets.http11 import Request

from app.server.door import ELSEWHERE, NAME, Answer, query_of

PREFIX = "X-Forwarded-Prefix"
"""The header in which a proxy tells the path that it removed; jupyter-server-proxy sends it."""


def under_its_name(request: Request) -> Answer | None:
    """Lets a request for the page's name open the page. Returns a redirect to that name for a request of the
    folder below a path, and for one that names a server, else None."""
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
