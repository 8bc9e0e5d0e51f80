"""Uploads: a file that is too large is refused in one sentence, and its memory is released."""

from __future__ import annotations

import io
import os
import signal
import zipfile
from collections.abc import Iterator

import pytest
from served import LONG, served
from viser import _messages

from app.adapter import private
from app.web.server import PageServer
from browsing.wire import Wire, eventually
from robots import CATALOG

PART = 500_000
LARGE = 40_000_000


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with served(max_sessions=8, grace=1.0) as running:
        yield running


def shown(page: Wire) -> str:
    """Returns the button to upload a robot, as soon as it exists."""
    assert eventually(lambda: page.find("Upload a URDF") is not None, LONG)
    button = page.find("Upload a URDF")
    return button or shown(page)


def upload(page: Wire, name: str, content: bytes, parts: int = 1, size: int | None = None) -> None:
    """Uploads a file. parts: how often the content is sent; size: the announced number of bytes."""
    button, size = shown(page), parts * len(content) if size is None else size
    page.say(_messages.FileTransferStartUpload(button, name, "robot.urdf", "text/xml", parts, size))
    for place in range(parts):
        page.say(_messages.FileTransferPart(button, name, place, content))


def refusals(page: Wire) -> int:
    return [title for title, _ in page.notices].count("Not uploaded")


def taken(page: Wire) -> bool:
    """Returns whether a later file is read; the page then shows the fault of its content."""
    upload(page, "small", b"\xff\0")
    return eventually(lambda: page.shows("is not text"), LONG)


@pytest.mark.parametrize("said", [LARGE, 100], ids=["honest", "lying"])
def test_each_page_is_told_once(server: PageServer, said: int) -> None:
    """Two pages upload at the same time after their robots were killed and restarted; each gets one
    refusal."""
    with Wire(server.link) as one, Wire(server.link) as two:
        before = {page: shown(page) for page in (one, two)}
        for learner in [each for each in server.sessions.learners if each.attached]:
            pid = learner.pid
            assert pid is not None
            os.kill(pid, signal.SIGKILL)
            assert eventually(lambda learner=learner: learner.trouble() is not None, LONG)
            learner.restart()
        for page, button in before.items():
            assert eventually(lambda page=page, button=button: shown(page) != button, LONG)
        for page in (one, two):
            upload(page, "large", bytes(PART), parts=24, size=said)
        for page in (one, two):
            assert eventually(lambda page=page: refusals(page) > 0, LONG)
            assert taken(page)
            assert refusals(page) == 1
        clients = server._viser.get_clients().values()
        assert eventually(lambda: all(private.unfinished_uploads(each) == 0 for each in clients), LONG)


def test_two_large_files_of_one_page_are_two_sentences(server: PageServer) -> None:
    with Wire(server.link) as page:
        for name in ("first", "second"):
            upload(page, name, bytes(PART), parts=2, size=LARGE)
        assert eventually(lambda: refusals(page) == 2, LONG)
        assert taken(page) and refusals(page) == 2


def test_a_zip_brings_its_meshes(server: PageServer) -> None:
    mesh = "o\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    text = CATALOG["planar3"].path.read_text()
    end = text.index(">", text.index("<link", text.index("<link") + 1)) + 1
    visual = '<visual><geometry><mesh filename="package://mine/meshes/part.obj"/></geometry></visual>'
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as made:
        made.writestr("mine/urdf/robot.urdf", text[:end] + visual + text[end:])
        made.writestr("mine/meshes/part.obj", mesh)
    with Wire(server.link) as page:
        upload(page, "zip", packed.getvalue())
        assert eventually(lambda: page.shows("scene <b>hold</b>"), LONG), page.notices
        assert not page.shows("not found")
        upload(page, "broken", b"PK\x03\x04" + bytes(100))
        assert eventually(lambda: page.shows("The zip cannot be read"), LONG)


def test_the_robot_tab_asks_for_the_hand_and_shows_how_the_robot_follows(server: PageServer) -> None:
    """A robot whose last body carries two frames; the target is dragged in a process of its own."""
    text = CATALOG["planar3"].path.read_text().replace('robot name="planar3"', 'robot name="mine"')
    last = CATALOG["planar3"].tip
    frames = "".join(
        f'<link name="ee_{k}"/><joint name="to_{k}" type="fixed"><parent link="{last}"/>'
        f'<child link="ee_{k}"/></joint>'
        for k in "ab"
    )
    with Wire(server.link) as page:
        upload(page, "mine", text.replace("</robot>", f"{frames}</robot>").encode())
        assert eventually(lambda: page.find("Hand") is not None, LONG), page.notices
        assert eventually(lambda: page.shows("findings</b> · follows within "), 2 * LONG)
        assert page.shows("hand at <b>ee</b>")
        page.write(page.find("Hand") or "", value="ee_a")
        assert eventually(lambda: page.shows("hand at <b>ee_a</b>"), LONG), page.notices


ONE_JOINT = """<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j"
type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><origin xyz="0.3 0 0"/>
<limit lower="-1" upper="1" velocity="3" effort="50"/></joint></robot>"""


def test_a_robot_with_one_joint_has_a_page(server: PageServer) -> None:
    """How it is controlled is tested in test_lessons_one_joint.py."""
    with Wire(server.link) as page:
        upload(page, "one", ONE_JOINT.encode())
        assert eventually(lambda: page.shows("1 joint"), LONG), page.notices
        assert eventually(lambda: page.shows("Running") and "/target" in page.controls_3d, LONG)


def test_a_file_for_what_was_replaced_is_told(server: PageServer) -> None:
    with Wire(server.link) as page:
        assert eventually(lambda: page.find("Upload a URDF") is not None, LONG)
        page.say(_messages.FileTransferStartUpload("gone", "one", "robot.urdf", "text/xml", 1, 10))
        assert eventually(lambda: any("was rebuilt" in body for _, body in page.notices), LONG)
