"""The module that the fork server imports first, see `app.link.fork_server`."""

from importlib import import_module

from app.link.fork_server import prepare

import_module("app.link.process")  # in which children begin
prepare()
