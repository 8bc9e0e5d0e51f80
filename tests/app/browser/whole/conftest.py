"""The fixtures of `iiwa`, once more: what these tests leave is nobody else's."""

from iiwa.conftest import page, server, shared_page

__all__ = ["page", "server", "shared_page"]
