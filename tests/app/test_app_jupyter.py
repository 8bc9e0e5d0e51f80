"""The icon in Jupyter's launcher: a real Jupyter server starts himpc-lab, and only its user gets in."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from http import HTTPStatus
from pathlib import Path

import psutil
import pytest
from served import answers
from websockets.exceptions import InvalidStatus

from app.jupyter.launcher import OPTIONS, launcher
from app.web.passes import HEADER, QUERY, USER_HEADER, VARIABLE
from browsing.hub import ROOT, entry_point
from browsing.wire import Wire, eventually

TOKEN, LONG = "the-token-of-the-jupyter-server", 120.0
MINE = {"Authorization": f"token {TOKEN}"}
FORGED = {USER_HEADER: "ben", HEADER: "x" * 20}


@pytest.fixture(scope="module")
def jupyter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """Yields the address of zoe's Jupyter server, and its log."""
    folder = tmp_path_factory.mktemp("jupyter")
    (folder / "key.txt").write_text("the key of the instructor")
    log = folder / "log"
    environment = {
        **os.environ,
        "PYTHONPATH": f"{entry_point(folder)}:{ROOT}",
        "JUPYTERHUB_USER": "zoe",
        "HOME": str(folder),
        OPTIONS: f"--key {folder}/key.txt --scene planar3-hold",
    }
    command = "jupyter_server --allow-root --no-browser --ip=127.0.0.1 --port=0"
    with log.open("w") as told:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                *command.split(),
                "--ServerApp.base_url=/user/zoe/",
                f"--IdentityProvider.token={TOKEN}",
            ],
            cwd=folder,
            env=environment,
            stdout=told,
            stderr=told,
        )
        try:
            assert eventually(lambda: bool(_addresses(log)) or process.poll() is not None, LONG)
            assert process.poll() is None, log.read_text()
            url = _addresses(log)[0]
            assert eventually(lambda: answers(int(url.split(":")[2].partition("/")[0])), LONG)
            yield url, log
        finally:
            own = psutil.Process(process.pid).children(recursive=True)
            process.terminate()
            process.wait(LONG)
            for each in own:
                if each.is_running():
                    each.kill()


def _addresses(log: Path) -> list[str]:
    return re.findall(r"(http://127\.0\.0\.1:[1-9]\d*/user/zoe/)", log.read_text())


def ask(url: str, headers: Mapping[str, str]) -> tuple[int, str]:
    """Returns the status and the address of the page after redirects."""
    request = urllib.request.Request(url, headers=dict(headers))
    try:
        with urllib.request.urlopen(request, timeout=LONG) as found:
            return found.status, found.url
    except urllib.error.HTTPError as refused:
        return refused.code, url


@pytest.mark.nightly("app/jupyter")
def test_only_the_user_of_the_jupyter_server_gets_in(jupyter: tuple[str, Path]) -> None:
    """Through Jupyter's path the page opens under its name, and from this address its web socket finds the
    same path. The account is the one that Jupyter sends, whatever the browser sends. All other requests are
    refused: to the port itself, by the path of any port, and with a token or an account of one's own."""
    url, log = jupyter
    status, page = ask(f"{url}himpc-lab/", {**MINE, **FORGED})
    assert (status, page) == (HTTPStatus.OK, f"{url}himpc-lab/page")
    assert ask(f"{url}himpc-lab/page", {})[1].startswith(f"{url}login?")
    (port,) = re.findall(r"himpc-lab ready at http://localhost:(\d+)", log.read_text())
    here = f"http://127.0.0.1:{port}"
    for way, headers in (
        (here, {}),
        (here, FORGED),
        (f"{here}/?{QUERY}=x", {}),
        (f"{url}proxy/{port}/", {**MINE, **FORGED}),
    ):
        assert ask(way, headers)[0] == HTTPStatus.FORBIDDEN
    for way, headers in ((f"{here}/page", FORGED), (f"{url}himpc-lab/page", FORGED)):
        with pytest.raises(InvalidStatus):
            Wire(way, headers)
    with Wire(f"{url}himpc-lab/page", {**MINE, **FORGED}) as wire:
        assert eventually(lambda: wire.shows("The text names your account, <b>zoe</b>"), LONG)
        assert not wire.shows("ben")


def test_the_launcher_says_what_it_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The token is new at each start and is on no command line. Braces in an option are not replaced. The
    name of the account can be sent in a header."""
    monkeypatch.setenv(OPTIONS, "--lesson 'my {lesson}.py'")
    monkeypatch.setenv("JUPYTERHUB_USER", "zoë {port}")
    first, second = launcher(), launcher()
    token = first["environment"][VARIABLE]
    assert token == first["request_headers_override"][HEADER] != second["environment"][VARIABLE]
    assert token not in " ".join(first["command"])
    assert [each.format(port=1) for each in first["command"]][-1] == "my {lesson}.py"
    assert first["request_headers_override"][USER_HEADER] == "zo%C3%AB%20%7Bport%7D"
    assert Path(first["launcher_entry"]["icon_path"]).read_text().startswith("<svg")
    assert json.dumps(first)
