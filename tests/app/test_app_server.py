"""The server without a browser: address, hardening, signals."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web import server
from app.web.server import FIRST, PageServer, ServerOptions
from lessons.scenes.run_spec import RunSpec
from robots import InputError

ROOT = Path(__file__).parents[2]


def test_wrong_addresses_and_scenes_are_one_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=r"in use.*--port"):
            PageServer(FIRST, ServerOptions(port=port))
    with pytest.raises(InputError, match="--host"):
        PageServer(FIRST, ServerOptions(host="203.0.113.7", port=0))
    with pytest.raises(InputError, match="Port 70000"):
        PageServer(FIRST, ServerOptions(port=70_000))
    with pytest.raises(InputError, match="iiwa14-hold"):
        PageServer(SceneChoice(RunSpec("iiwa14-hodl")), ServerOptions())
    with pytest.raises(InputError):
        PageServer(SceneChoice(RunSpec("hold", "/nowhere.urdf")), ServerOptions())
    with pytest.raises(InputError, match="1 or more"):
        PageServer(FIRST, ServerOptions(max_sessions=0))


def test_a_port_that_was_taken_meanwhile_gives_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setattr(server, "check_address", lambda *_: None)
        with pytest.raises(InputError, match="is in use"):
            PageServer(FIRST, ServerOptions(port=taken.getsockname()[1], max_sessions=1))


def test_one_line_and_a_clean_end() -> None:
    """After SIGTERM; Ctrl-C is in test_commands_interrupted.py."""
    code = (
        "import app.commands.early, sys; from app.web.server import FIRST, PageServer, ServerOptions; "
        "from app.web.serving import serve; "
        "sys.exit(serve(PageServer(FIRST, ServerOptions(port=0)), open_browser=False))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line.startswith("himpc-lab ready at http://127.0.0.1:")
    found = psutil.Process(process.pid)
    assert wait_until(lambda: bool(found.children(recursive=True)), 20.0)
    children = found.children(recursive=True)
    process.send_signal(signal.SIGTERM)
    out, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert out == "" and "Traceback" not in errors
    assert wait_until(lambda: not any(child.is_running() for child in children), 10.0)
