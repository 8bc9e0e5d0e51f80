"""How the server starts and ends: wrong addresses, the owner's browser, the addresses that are printed."""

from __future__ import annotations

import os
import re
import signal
import socket
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import psutil
import pytest
from served import LONG, served

from app.__main__ import main
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.web import server as module
from app.web.server import FIRST, PageServer, ServerOptions, seen_from_outside
from app.web.serving import greeting, opened_in_a_browser
from lessons.own.files import Folder
from lessons.scenes.run_spec import RunSpec
from robots import InputError

ROOT = Path(__file__).parents[2]
BROWSER = """#!{python}
import sys, time, pathlib
said = pathlib.Path({said!r})
said.with_suffix(".part").write_text("\\n".join(sys.argv[1:]))
said.with_suffix(".part").rename(said)
time.sleep(60)
"""


@pytest.fixture
def browser(tmp_path: Path) -> Path:
    """Returns a program that writes its arguments to a file and keeps running."""
    path = tmp_path / "browser"
    path.write_text(BROWSER.format(python=sys.executable, said=str(tmp_path / "said")))
    path.chmod(0o755)
    return path


def test_no_argument_list_holds_what_the_browser_is_opened_with(browser: Path, tmp_path: Path) -> None:
    """Every user of the machine can read argument lists. The browser therefore opens a file that no other
    user can read; it redirects to the page. After SIGTERM (for Ctrl-C see test_commands_interrupted.py), file
    and processes are gone, and only one line was printed."""
    places = tmp_path / "places"
    places.mkdir()
    with subprocess.Popen(
        [sys.executable, "-m", "app", "--port", "0", "--scene", "planar3-hold"],
        cwd=ROOT,
        env={**os.environ, "BROWSER": str(browser), "TMPDIR": str(places)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        umask=0,
    ) as lab:
        try:
            assert lab.stdout is not None
            found = re.search(r"ready at (http\S+=(\S+))", lab.stdout.readline())
            assert found is not None
            link, secret = found.groups()
            assert wait_until((tmp_path / "said").exists, LONG)
            opened = (tmp_path / "said").read_text()
            lists = [
                " ".join(each.cmdline())
                for each in (psutil.Process(lab.pid), *psutil.Process(lab.pid).children(recursive=True))
            ]
            assert any(str(browser) in each for each in lists)
            assert not [each for each in (*lists, opened) if secret in each]
            file = Path(opened.removeprefix("file://"))
            assert link in file.read_text()
            assert stat.S_IMODE(file.stat().st_mode) == 0o600
            assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
        finally:
            started = {each: each.cmdline() for each in psutil.Process(lab.pid).children(recursive=True)}
            browsers = [each for each, words in started.items() if str(browser) in words]
            children = [each for each in started if each not in browsers]
            lab.send_signal(signal.SIGTERM)
            lab.wait(LONG)
            for each in browsers:
                if each.is_running():
                    each.kill()
            said, errors = lab.communicate()
    assert (lab.returncode, said) == (0, "") and "Traceback" not in errors, errors
    assert len(children) > 1 and wait_until(lambda: not any(each.is_running() for each in children), LONG)
    assert not file.exists() and not file.parent.exists()


def test_the_file_leads_to_the_page_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    link = 'http://127.0.0.1:8080/?himpc-token=a&b="><script>'
    with opened_in_a_browser(link):
        assert wait_until(lambda: bool(opened), LONG)
        text = Path(opened[0].removeprefix("file://")).read_text()
        assert "<script>" not in text and "&amp;b=&quot;" in text


def test_who_works_alone_reads_one_line() -> None:
    with served(own_files=Folder.at(".")) as server:
        assert [*greeting(server)] == [f"himpc-lab ready at {server.link}"]
        assert str(server.passes.owner) in server.link


def test_who_serves_others_reads_which_address_is_for_whom() -> None:
    """The first address is the owner's, and no other line contains the owner's secret."""
    origin = "https://lab.example.org"
    with served(own_files=Folder.at("."), trusted_origins=[origin], classroom=True) as server:
        first, *others = greeting(server)
        owner, token = server.passes.owner, server.passes.token
        assert owner and token and owner != token
        assert first == f"himpc-lab ready at {server.link}" and first.endswith(owner)
        assert all(line.startswith("  ") for line in others)
        assert owner not in "".join(others)
        assert others[0] == f"  for others:           {server.url}/?himpc-token={token}"
        assert others[1] == f"  through the proxy:    {origin}/?himpc-token={token}"
        assert others[2].startswith("  instructor's token:   ")
        assert "Keep the first address secret" in others[3] and "--no-own-files" in others[3]


def test_a_server_of_a_network_is_shown_with_its_number() -> None:
    with served(own_files=Folder.at("."), host="0.0.0.0") as server:
        numbers = seen_from_outside("0.0.0.0", server.url)
        assert f"  for others:           {numbers}/?himpc-token={server.passes.token}" in [*greeting(server)]


def test_no_token_says_what_it_gives_up() -> None:
    with served(ask_token=False) as server:
        first, told = greeting(server)
        assert first == f"himpc-lab ready at {server.url}"
        assert "--no-token: every user of this machine" in told


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
        monkeypatch.setattr(module, "check_address", lambda *_: None)
        with pytest.raises(InputError, match="is in use"):
            PageServer(FIRST, ServerOptions(port=taken.getsockname()[1], max_sessions=1))


def test_the_command_passes_its_options_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command also accepts several proxies."""
    asked: dict[str, Any] = {}
    monkeypatch.setattr("app.web.server.PageServer", lambda _, options: asked.update(vars(options)))
    monkeypatch.setattr("app.web.serving.serve", lambda _, **options: 0)
    first, second = "https://lab.example.org", "https://b.example.org"
    for words, options in (
        ("", {"class_names": None, "ask_token": True, "own_files": Folder.at(".")}),
        ("--class", {"class_names": True}),
        ("--class --no-names", {"class_names": False}),
        (f"--trusted-origin {first} --trusted-origin {second}", {"trusted_origins": (first, second)}),
        ("--no-token --no-own-files", {"ask_token": False, "own_files": None}),
        (f"--own-files {ROOT}", {"own_files": Folder(ROOT)}),
    ):
        assert main(["--no-browser", *words.split()]) == 0
        assert {name: asked[name] for name in options} == options
    for words in (
        "--no-names",
        "--own-files /nowhere",
        "--own-files . --no-own-files",
        "--class --proxy-only",
    ):
        assert main(["--no-browser", *words.split()]) == 2
    assert f"--trusted-origin {first}" in capsys.readouterr().err
