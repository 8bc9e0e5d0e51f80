"""The page below a path of another site.

viser's page opens its web socket at its own address without the slash at the end. A proxy that serves it
below a path redirects such an address to the one with the slash, and browsers do not follow redirects of web
sockets. So below a path the page has a name.
"""

from __future__ import annotations

from http import HTTPStatus
from urllib.parse import urlsplit

from websockets.http11 import Request

from app.server.door import Answer

NAME = "page"
PREFIX = "X-Forwarded-Prefix"
"""The header in which a proxy tells the path that it removed; jupyter-server-proxy sends it."""


def under_its_name(request: Request) -> Answer | None:
    """Lets a request for the page's name open the page. Returns a redirect to that name for a request of the
    folder below a path, else None."""
    parts = urlsplit(request.path)
    query = f"?{parts.query}" if parts.query else ""
    if parts.path == f"/{NAME}":
        request.path = f"/{query}"
    elif parts.path == "/" and any(each.strip("/") for each in request.headers.get_all(PREFIX)):
        link = (("Location", f"./{NAME}{query}"), ("Cache-Control", "no-store"))
        return Answer(HTTPStatus.SEE_OTHER, "himpc-lab", "Opening …", link)
    return None
