"""The entry point of jupyter-server-proxy: an icon in Jupyter's launcher that starts himpc-lab."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import Any
from urllib.parse import quote

from app.web.passes import HEADER, USER_HEADER, VARIABLE, new_token

OPTIONS = "HIMPC_LAB_OPTIONS"
"""The environment variable with further options of the command."""
_PATIENCE = 60.0  # s within which the server must answer; a busy host may take long for the imports


def launcher() -> dict[str, Any]:
    """Returns the data that jupyter-server-proxy needs: command, environment, request headers and icon.

    The token is new. Only this Jupyter server and the process that it starts know it: other users of the
    machine can connect to the port, but are refused. The user's name comes from the hub. If a browser sends a
    header for this name, jupyter-server-proxy replaces it.
    """
    token = new_token()
    more = [_literal(option) for option in shlex.split(os.environ.get(OPTIONS, ""))]
    # localhost has two addresses, and jupyter-server-proxy may use either of them. Therefore the server
    # listens at both, and no other program can.
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
    """Escapes an option, so that jupyter-server-proxy replaces nothing in it."""
    return option.replace("{", "{{").replace("}", "}}")
