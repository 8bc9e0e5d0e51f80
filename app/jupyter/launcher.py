"""The entry point of jupyter-server-proxy: an icon in Jupyter's launcher that starts himpc-lab."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

from app.server.passes import HEADER, USER_HEADER, VARIABLE, new_token

OPTIONS = "HIMPC_LAB_OPTIONS"
"""The environment variable with further options of the command."""
_PATIENCE = 60.0  # s until the server must answer: a busy host may take long to import everything


def launcher() -> dict[str, Any]:
    """What jupyter-server-proxy needs to know: command, environment, request headers and icon.

    The token is new, and only this Jupyter server and the process that it starts have it: other users of the
    machine can connect to the port, but are not let in. The user's name is the hub's; jupyter-server-proxy
    replaces headers of that name which a browser sends.
    """
    token = new_token()
    more = [_literal(option) for option in shlex.split(os.environ.get(OPTIONS, ""))]
    # localhost: jupyter-server-proxy may ask for both of its addresses, so nobody else may listen at either.
    serving = ["--no-browser", "--host", "localhost", "--port", "{port}", "--proxy-only", "--no-own-files"]
    return {
        "command": [sys.executable, "-P", "-m", "app", *serving, *more],
        "environment": {VARIABLE: token},
        "request_headers_override": {
            HEADER: token,
            USER_HEADER: quote(os.environ.get("JUPYTERHUB_USER", "")),
        },
        "timeout": _PATIENCE,
        "launcher_entry": {
            "title": "himpc-lab",
            "icon_path": str(Path(__file__).with_name("himpc-lab.svg")),
            "category": "Notebook",
        },
    }


def _literal(option: str) -> str:
    """An option in which jupyter-server-proxy replaces nothing."""
    return option.replace("{", "{{").replace("}", "}}")
