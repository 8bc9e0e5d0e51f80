"""The module that the fork server imports first, see `app.link.fork_server`."""

from app.link.fork_server import prepare

prepare()
