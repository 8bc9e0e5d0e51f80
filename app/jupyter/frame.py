"""Finds the address of Jupyter's page, and the address at which this page can show a server of this kernel in
a frame."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import urlsplit

from app.web.door import SELF, as_origin

_PROXY, _COLAB = "jupyter_server_proxy", "COLAB_RELEASE_TAG"


@dataclass(frozen=True)
class Surroundings:
    """The Jupyter server of this kernel.

    Attributes:
        address: the address that the user opens, e.g. http://localhost:8888/user/zoe/; only the path if the
            host is not known.
        proxied: whether the server passes on requests for other ports, with jupyter-server-proxy.
    """

    address: str
    proxied: bool

    @property
    def origin(self) -> str | None:
        """The origin of the address as browsers write it; None if only the path is known."""
        parts = urlsplit(self.address)
        return as_origin(f"{parts.scheme}://{parts.netloc}") if parts.netloc else None

    def source(self, port: int, query: str) -> str:
        """Returns the address of a frame that shows the server at a port of this machine. Through Jupyter,
        the address contains no host name, so that it works under any name of the machine."""
        parts = urlsplit(self.address)
        if self.proxied:
            return f"{parts.path.rstrip('/')}/proxy/{port}/?{query}"
        return f"http://{parts.hostname or 'localhost'}:{port}/?{query}"

    @property
    def embedders(self) -> tuple[str, ...]:
        """Returns the origins of the pages that may show the frame. If Jupyter passes on requests, this is
        only the frame's own origin."""
        if self.proxied:
            return (SELF,)
        return () if self.origin is None else (self.origin,)


def surroundings(environment: Mapping[str, str]) -> Surroundings | None:
    """Returns the Jupyter server that started this process; None if there is none."""
    proxied = find_spec(_PROXY) is not None
    if _COLAB in environment:
        return None  # its server has an address that no browser can reach
    prefix = environment.get("JUPYTERHUB_SERVICE_PREFIX")
    if prefix is not None:
        public = urlsplit(environment.get("JUPYTERHUB_PUBLIC_URL", ""))
        where = f"{public.scheme}://{public.netloc}" if public.netloc else ""
        return Surroundings(where + prefix, proxied)
    server = environment.get("JPY_PARENT_PID", "")
    if not server.isdigit() or find_spec("jupyter_core") is None:
        return None
    from jupyter_core.paths import jupyter_runtime_dir

    about = Path(jupyter_runtime_dir()) / f"jpserver-{server}.json"
    try:
        return Surroundings(str(json.loads(about.read_text())["url"]), proxied)
    except (OSError, ValueError, KeyError):
        return None


def outside(environment: Mapping[str, str], port: int) -> tuple[bool, str]:
    """Returns, for a notebook without a Jupyter server whose address is known: whether its browser may reach
    a port of this machine, and a sentence with the next step ("" if there is nothing to say)."""
    if _COLAB in environment:
        return False, (
            "Google Colab does not pass the page on to your browser. Python controls the robot here without "
            "it. For the page, install himpc-lab on your own machine, or himpc-lab[jupyter] in a JupyterHub."
        )
    remote = "VSCODE_PID" in environment or "VSCODE_IPC_HOOK_CLI" in environment
    return True, f"On another machine, first add port {port} in VS Code's tab Ports." if remote else ""


def here() -> Surroundings | None:
    return surroundings(os.environ)
