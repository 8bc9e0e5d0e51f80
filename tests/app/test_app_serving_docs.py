"""The nginx configuration in docs/serving.md, tested as it is printed."""

from __future__ import annotations

import base64
import http.client
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import tempfile
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from served import LONG, answers, free_port, served
from viser import __version__
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.process import wait_until
from app.web.passes import HEADER, QUERY
from app.web.server import PageServer
from app.web.visit import place_read, place_written
from browsing.tab import Storage, opened
from browsing.wire import Wire, camera, eventually, pack
from lessons.own.files import Folder
from lessons.scenes.run_spec import RunSpec

PAGE = Path(__file__).parents[2] / "docs" / "serving.md"
NAME = "lab.example.org"
PROTOCOL: Any = [f"viser-v{__version__}"]
NGINX = pytest.mark.nightly("app/web", "docs/serving.md")


@pytest.fixture(scope="module")
def nginx() -> str:
    path = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin:/usr/local/sbin")
    if path is None:
        reason = "no nginx found: install one (Debian: apt-get install nginx) to test docs/serving.md"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return path


@pytest.fixture(scope="module")
def proxied(nginx: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[PageServer, int, Path]]:
    """Yields the page, nginx's port for it, and the certificate."""
    folder, port = tmp_path_factory.mktemp("nginx"), free_port()
    certificate, key = folder / "lab.pem", folder / "lab.key"
    subprocess.run(
        f"openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN={NAME} "
        f"-addext subjectAltName=DNS:{NAME} -keyout {key} -out {certificate}".split(),
        check=True,
        capture_output=True,
    )
    origin = f"https://{NAME}:{port}"
    printed = re.findall(r"```nginx\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(printed) == 1
    with served(trusted_origins=[origin], own_files=Folder.at(str(folder))) as server:
        site = replaced(
            printed[0],
            ("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"),
            (f"/etc/ssl/certs/{NAME}.pem", str(certificate)),
            (f"/etc/ssl/private/{NAME}.key", str(key)),
            ("http://127.0.0.1:8080", server.url),
        )
        with nginx_with(nginx, folder, site, port):
            yield server, port, certificate


def replaced(site: str, *texts: tuple[str, str]) -> str:
    """Returns the printed configuration with what holds here."""
    for text, here in texts:
        assert text in site
        site = site.replace(text, here)
    return site


@contextmanager
def nginx_with(nginx: str, folder: Path, site: str, port: int) -> Iterator[None]:
    """Runs nginx with a configuration that listens on a port, until the context ends."""
    assert not answers(port), f"another server listens on port {port}, and would be taken for nginx"
    folders = "".join(
        f"{kind}_temp_path {folder}/{kind};\n"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    main = folder / "nginx.conf"
    main.write_text(
        f"daemon off; pid {folder}/pid; error_log {folder}/error.log;\nevents {{}}\n"
        f"http {{\naccess_log off;\n{folders}{site}}}\n"
    )
    command = [nginx, "-c", str(main), "-e", str(folder / "start.log")]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        assert wait_until(lambda: answers(port) or process.poll() is not None, LONG)
        assert process.poll() is None, (folder / "error.log").read_text()
        yield
    finally:
        process.terminate()
        process.wait(LONG)


def get(port: int, certificate: Path, path: str = "/", *, host: str = NAME, cookie: str = "") -> str:
    """Returns the head of the response."""
    context = ssl.create_default_context(cafile=str(certificate))
    with (
        socket.create_connection(("127.0.0.1", port), timeout=LONG) as plain,
        context.wrap_socket(plain, server_hostname=NAME) as wrapped,
    ):
        lines = [f"GET {path} HTTP/1.1", f"Host: {host}:{port}", f"Cookie: {cookie}", "Connection: close"]
        wrapped.sendall("\r\n".join([*lines, "", ""]).encode())
        head = b""
        while b"\r\n\r\n" not in head and (more := wrapped.recv(4096)):
            head += more
        return head.partition(b"\r\n\r\n")[0].decode()


def dial(port: int, certificate: Path, origin: str, cookie: str) -> Any:
    return connect(
        f"wss://{NAME}:{port}/",
        sock=socket.create_connection(("127.0.0.1", port), timeout=LONG),
        ssl=ssl.create_default_context(cafile=str(certificate)),
        origin=origin,  # pyright: ignore[reportArgumentType]
        additional_headers={"Cookie": cookie},
        subprotocols=PROTOCOL,
        max_size=None,
        proxy=None,
    )


@NGINX
def test_the_printed_proxy_shows_the_page(proxied: tuple[PageServer, int, Path]) -> None:
    """The page opens with TLS, the token and web sockets; other origins and hosts are refused."""
    server, port, certificate = proxied
    origin = f"https://{NAME}:{port}"
    assert " 403 " in get(port, certificate)
    first = get(port, certificate, f"/?{QUERY}={server.passes.token}")
    assert " 303 " in first and "; Secure" in first
    found = re.search(r"Set-Cookie: ([^;]+)", first)
    assert found is not None
    cookie = found[1]
    head = get(port, certificate, cookie=cookie)
    assert " 200 " in head and "frame-ancestors 'none'" in head
    assert " 403 " in get(port, certificate, cookie=cookie, host="evil.example")
    for wrong, brought in (("https://evil.example", cookie), (origin, "")):
        with pytest.raises(InvalidStatus) as refused:
            dial(port, certificate, wrong, brought)
        assert refused.value.response.status_code == 403
    assert not server.sessions.learners
    with dial(port, certificate, origin, cookie) as page:
        page.send(pack(camera()))
        assert page.recv(timeout=LONG)
        assert wait_until(lambda: len(server.sessions.learners) == 1, LONG)


@NGINX
def test_phones_need_no_password_and_get_no_account(nginx: str, tmp_path: Path) -> None:
    """With the printed locations of a class, only a correct password opens a robot's page, even if an address
    is written in an unusual way."""
    port, token = free_port(), "the-token-of-the-proxy"
    (printed,) = re.findall(r"```text\n(location / .*?)```", PAGE.read_text(), re.DOTALL)

    def status(path: str, password: str | None, upgrade: bool = False) -> int:
        more = {}
        if password is not None:
            more["Authorization"] = f"Basic {base64.b64encode(f'prof:{password}'.encode()).decode()}"
        if upgrade:
            more |= {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
            more |= {"Sec-WebSocket-Key": "x" * 22 + "==", "Sec-WebSocket-Protocol": PROTOCOL[0]}
        with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=LONG)) as connection:
            connection.request("GET", path, headers=more)
            return connection.getresponse().status

    by_proxy = {"token": token, "proxy_only": True, "trusted_origins": [f"http://127.0.0.1:{port}"]}
    with tempfile.NamedTemporaryFile("w") as users, served(class_names=True, **by_proxy) as server:
        users.write("prof:{PLAIN}right\n")
        users.flush()
        os.chmod(users.name, 0o644)  # nginx may run as another user
        site = replaced(
            printed,
            ("http://127.0.0.1:8080", server.url),
            ("/etc/nginx/lab.htpasswd", users.name),
            ("-Token TOKEN", f"-Token {token}"),
        )
        kind = "map $http_upgrade $connection_upgrade { default upgrade; '' close; }"
        with nginx_with(nginx, tmp_path, f"{kind}\nserver {{ listen 127.0.0.1:{port}; {site} }}", port):
            assert server.hall is not None
            phones = f"/v/{server.hall.code}"
            assert status(phones, None) == 200 and status(phones, None, True) == 101
            assert status("/", None) == 401 and status("/", "wrong", True) == 401
            for path in ("//v/x", "/%76/x", "/x/../v/x", "/v/../", "/v/%2e%2e/page"):
                assert status(path, "wrong", True) in (401, 403), path
            assert not server.sessions.learners
            assert status("/", "right", True) == 101


@contextmanager
def balanced(nginx: str, folder: Path) -> Iterator[tuple[str, list[PageServer]]]:
    """Runs two servers of one session each, with one token, behind the printed balancer."""
    port, token = free_port(), "one-token-for-all-servers"
    origin = f"http://127.0.0.1:{port}"
    options = {"grace": 0.5, "trusted_origins": [origin], "token": token, "refers": True}
    (site,) = re.findall(r"```text\n(upstream .*?)```", PAGE.read_text(), re.DOTALL)
    with served(**options) as first, served(**options) as second:
        site = replaced(
            site,
            ("lab-1.example.org:8080", first.url.removeprefix("http://")),
            ("lab-2.example.org:8080", second.url.removeprefix("http://")),
            ("listen 80;", f"listen 127.0.0.1:{port};"),
        )
        with nginx_with(nginx, folder, site, port):
            yield f"{origin}/?{QUERY}={token}", [first, second]


def learners(servers: Sequence[PageServer]) -> list[SimulationClient]:
    return [each for server in servers for each in server.sessions.learners if each.attached]


@NGINX
def test_a_full_server_behind_the_printed_balancer_is_passed_over(nginx: str, tmp_path: Path) -> None:
    """There are two servers of one session each, with one token. The second learner gets the second robot;
    the third is asked to wait, and gets the place that becomes free."""
    with balanced(nginx, tmp_path) as (link, servers):
        origin, _, token = link.partition(f"/?{QUERY}=")
        with Wire(link):
            assert eventually(lambda: len(learners(servers)) == 1, LONG)
            with Wire(link):
                assert eventually(lambda: len(learners(servers)) == 2, LONG)
                assert [len(each.sessions.learners) for each in servers] == [1, 1]
                with pytest.raises(InvalidStatus) as refused:
                    connect(link.replace("http", "ws"), subprotocols=PROTOCOL)
                assert refused.value.response.status_code == 503
                with pytest.raises(urllib.error.HTTPError) as waiting:
                    urllib.request.urlopen(urllib.request.Request(origin, headers={HEADER: token}))
                assert waiting.value.code == 503 and waiting.value.headers["Refresh"] == "5"
            assert eventually(lambda: sum(len(each.sessions.learners) for each in servers) == 1, LONG)
            with Wire(link):
                assert eventually(lambda: len(learners(servers)) == 2, LONG)


@NGINX
def test_a_page_goes_on_with_another_server_where_it_was(nginx: str, tmp_path: Path) -> None:
    """A server that is going to stop admits nobody and informs its page. After it has ended, the page's
    browser brings the step of its lesson, or the settings of its scene, to the other server."""
    lesson = SceneChoice.of_lesson(LessonPlace.at("one-task", 2))
    with balanced(nginx, tmp_path) as (link, servers):
        storage = Storage()
        with opened(link, storage, LONG) as page:
            assert eventually(lambda: len(learners(servers)) == 1, LONG)
            (learner,) = learners(servers)
            (first,) = (each for each in servers if each.sessions.learners)
            (second,) = (each for each in servers if each is not first)
            learner.load(lesson)
            assert eventually(lambda: '"step": 2' in "".join(storage.session.values()), LONG)
            now = threading.Event()
            draining = threading.Thread(target=first.drain, args=(LONG, now))
            draining.start()
            assert eventually(lambda: any(title == "The lab stops" for title, _ in page.notices), LONG)
            assert page.is_open
            with pytest.raises(urllib.error.HTTPError) as health:
                urllib.request.urlopen(f"{first.url}/health")
            assert json.loads(health.value.read())["state"] == "stopping"
            now.set()
            draining.join()
            first.close()
            assert eventually(lambda: not page.is_open, LONG)
        with opened(link, storage, LONG) as page:
            assert eventually(lambda: len(learners([second])) == 1, LONG)
            (learner,) = learners([second])
            assert eventually(lambda: learner.choice.exercise == lesson.exercise, LONG)
            assert eventually(lambda: page.shows("2 of"), LONG)
            assert not [key for key in storage.local if "place" in key]
            learner.load(SceneChoice(RunSpec("planar3-hold", set=("horizon=7",))))
            assert eventually(lambda: '"code"' in "".join(storage.session.values()), LONG)
        assert eventually(lambda: not second.sessions.learners, LONG)
        storage.session, kept = {}, storage.session
        with opened(link, storage, LONG):  # another tab of this browser begins anew
            assert eventually(lambda: len(learners([second])) == 1, LONG)
            (learner,) = learners([second])
            assert eventually(lambda: learner.settings is not None, LONG)
            assert learner.settings is not None and learner.settings.horizon != 7
        assert eventually(lambda: not second.sessions.learners, LONG)
        storage.session = kept
        with opened(link, storage, LONG):
            assert eventually(lambda: len(learners([second])) == 1, LONG)
            (learner,) = learners([second])
            assert eventually(lambda: getattr(learner.settings, "horizon", 0) == 7, LONG)


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[1]", "[" * 9000, '{"start": 1}', '{"start": "S", "code": "hl1-AAAA"}'),
        '{"start": "S", "lesson": "/etc/passwd", "step": 1}',
        '{"start": "S", "lesson": ["one-task"], "step": 1}',
        '{"start": "S", "lesson": "one-task", "step": 99}',
        '{"start": "S", "code": 5}',
        '{"start": "T", "lesson": "one-task", "step": 1}',
    ],
)
def test_a_place_that_cannot_be_read_is_none(text: str) -> None:
    """The place may have been written by anybody. Therefore only a step of the course or a state code is
    opened, and only for a server that was started with the same scene."""
    start = SceneChoice(RunSpec("planar3-hold"))
    step = SceneChoice.of_lesson(LessonPlace.at("one-task", 2))
    right = place_written(step, "", start)
    assert place_read(right, start) == step
    assert place_read(right, step) is None
    assert place_read(text.replace('"S"', json.dumps(json.loads(right)["start"])), start) is None


def test_the_page_names_options_that_exist() -> None:
    """Every option in the text is an option of the command."""
    from app.commands.serve import serve

    shown = set(re.findall(r"--([a-z][a-z-]*)", PAGE.read_text()))
    names = {
        name.rstrip("_").replace("_", "-")
        for name in serve.__code__.co_varnames[: serve.__code__.co_argcount]
    }
    assert {"host", "trusted-origin", "no-token"} <= shown
    assert shown <= names
