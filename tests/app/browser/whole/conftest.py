"""The fixtures of `iiwa`, with a server of their own, because these tests change the state of the server."""

from iiwa.conftest import page, server, shared_page

__all__ = ["page", "server", "shared_page"]
