"""A robot is loaded from a folder or a zip, with its meshes. A stranger's zip costs bounded time and memory,
and writes nothing outside its own folder."""

from __future__ import annotations

import io
import os
import pickle
import stat
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
from arms import INERTIAL, link, two_joint_arm

from robots import InputError, check_urdf, load_robot, load_urdf_text
from robots.loading import archive
from robots.shapes.link_shapes import link_shapes
from robots.urdf.read import root_tag


def ball() -> bytes:
    import trimesh

    file = io.BytesIO()
    trimesh.creation.icosphere(subdivisions=1).export(file, "stl")
    return file.getvalue()


ARM = two_joint_arm(
    l2=link(
        "l2",
        f'{INERTIAL}<visual><geometry><mesh filename="package://arm/meshes/ball.stl" scale="0.1 0.1 0.1"/>'
        "</geometry></visual>",
    )
)
FILES = {"arm/urdf/arm.urdf": ARM.encode(), "arm/meshes/ball.stl": ball()}


def packed(files: dict[str, bytes | str] | dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as made:
        for name, content in files.items():
            made.writestr(name, content)
    return file.getvalue()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which temporary folders are made."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    return tmp_path


@pytest.mark.parametrize("kind", ["folder", "zip", "file in the zip", "uploaded"])
def test_a_folder_and_a_zip_bring_the_meshes_along(here: Path, kind: str) -> None:
    for name, content in FILES.items():
        (here / "mine" / name).parent.mkdir(parents=True, exist_ok=True)
        (here / "mine" / name).write_bytes(content)
    (here / "mine.zip").write_bytes(packed(FILES))
    if kind == "uploaded":
        robot = load_urdf_text(packed(FILES))
    else:
        robot = load_robot(
            here / {"folder": "mine", "zip": "mine.zip"}.get(kind, "mine.zip/arm/urdf/arm.urdf")
        )
    assert robot.n == 2
    assert not list((here / "temporary").iterdir())
    for each in (robot, pickle.loads(pickle.dumps(robot)), replace(robot, tip="l1")):
        assert {len(shape.faces) for shape in link_shapes(each) if shape.name == "l2/0"} == {80}
    assert "not found" not in str(robot.report.findings)
    assert "temporary" not in robot.urdf_text
    assert [solid.source for solid in robot.collision.solids if solid.link == "l2"] == ["hull"]


def test_a_mujoco_model_in_a_zip_finds_its_meshes(here: Path) -> None:
    text = """<mujoco><compiler meshdir="assets"/>
        <asset><mesh name="ball" file="ball.stl" scale="0.1 0.1 0.1"/></asset>
        <worldbody><body name="a"><joint name="turn" armature="0.1"/><geom type="mesh" mesh="ball"/></body>
        </worldbody></mujoco>"""
    robot = load_urdf_text(packed({"arm/arm.xml": text.encode(), "arm/assets/ball.stl": ball()}))
    assert robot.joint_names == ("turn",)
    assert {len(shape.faces) for shape in link_shapes(robot) if shape.name == "a/0"} == {80}


def test_one_of_several_descriptions_is_chosen(here: Path) -> None:
    files = {"a/one.urdf": ARM.encode(), "a/two.urdf": ARM.encode(), "a/notes.xml": b"<notes/>"}
    (here / "mine.zip").write_bytes(packed(files))
    for name, content in files.items():
        (here / "mine" / name).parent.mkdir(parents=True, exist_ok=True)
        (here / "mine" / name).write_bytes(content)
    for name in ("mine", "mine.zip"):
        with pytest.raises(
            InputError, match=r"has 2 robot descriptions \('a/one.urdf', 'a/two.urdf'\)"
        ) as told:
            load_robot(here / name)
        assert f"choose one, such as {here / name}/a/one.urdf" in str(told.value)
        assert load_robot(here / name / "a" / "two.urdf").n == 2
    with pytest.raises(InputError, match="leave only one of them in the zip"):
        load_urdf_text(packed(files))
    # A description with the name of the folder is the one that is meant.
    (here / "one.zip").write_bytes(packed(files))
    assert load_robot(here / "one.zip").n == 2
    with pytest.raises(InputError, match="no robot description"):
        load_urdf_text(packed({"readme.txt": b"", "robot.xacro": b"<robot/>"}))
    with pytest.raises(InputError, match="Cannot read"):
        load_robot(here / "mine.zip" / "nowhere.urdf")
    with pytest.raises(InputError, match=r"mine.zip/\.\./.* is not in the folder"):
        load_robot(here / "mine.zip" / ".." / ".." / "mine" / "a" / "nowhere.urdf")
    assert check_urdf(here / "one.zip").usable


def test_a_named_pipe_in_a_folder_is_not_opened(here: Path) -> None:
    """Opening it would wait until somebody writes to it."""
    folder = here / "with_a_pipe"
    folder.mkdir()
    os.mkfifo(folder / "a.xml")
    (folder / "arm.urdf").write_text(two_joint_arm())
    assert load_robot(folder).n == 2


def test_a_zip_stays_in_the_folder_whose_files_may_be_opened(here: Path) -> None:
    (here / "own").mkdir()
    for name in ("own/mine.zip", "other.zip"):
        (here / name).write_bytes(packed(FILES))
    (here / "own" / "link").symlink_to(here)
    assert load_robot(here / "own" / "mine.zip", within=here / "own").n == 2
    for outside in ("other.zip", "own/link/other.zip", "own/../other.zip"):
        with pytest.raises(InputError, match="not in the folder whose files may be opened"):
            load_robot(here / outside, within=here / "own")
    (here / "own" / "robot").mkdir()
    (here / "own" / "robot" / "arm.urdf").symlink_to(here / "arm.urdf")
    (here / "arm.urdf").write_text(ARM)
    with pytest.raises(InputError, match="not in the folder whose files may be opened"):
        load_robot(here / "own" / "robot", within=here / "own")


def with_link(target: str) -> bytes:
    """Returns a zip whose mesh is a symbolic link."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as made:
        made.writestr("arm/urdf/arm.urdf", ARM)
        entry = zipfile.ZipInfo("arm/meshes/ball.stl")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        made.writestr(entry, target)
    return file.getvalue()


def encrypted() -> bytes:
    """Returns a zip that says that its file is encrypted."""
    data = bytearray(packed({"arm.urdf": ARM.encode()}))
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    return bytes(data)


def lying() -> bytes:
    """Returns a zip of 100 MB that says that it has 5 bytes."""
    data = bytearray(packed({"arm.urdf": bytes(100_000_000)}))
    data[22:26] = data[data.index(b"PK\x01\x02") + 24 :][:4] = (5).to_bytes(4, "little")
    central = data.index(b"PK\x01\x02")
    data[central + 24 : central + 28] = (5).to_bytes(4, "little")
    return bytes(data)


BOMB = {f"meshes/{k}.stl": bytes(50_000_000) for k in range(8)}
HOSTILE = {
    "a bomb": (lambda: packed({**FILES, **BOMB}), "more than 300 MB"),
    "a zip in a zip": (lambda: packed({"arm.zip": packed(FILES)}), "no robot description"),
    "out of the folder": (
        lambda: packed({**FILES, "../../evil.urdf": ARM.encode()}),
        "leads out of its folder",
    ),
    "an absolute path": (lambda: packed({"/tmp/evil.urdf": ARM.encode()}), "leads out of its folder"),
    "a path of Windows": (lambda: packed({"..\\evil.urdf": ARM.encode()}), "leads out of its folder"),
    "a drive": (lambda: packed({"C:/evil.urdf": ARM.encode()}), "leads out of its folder"),
    "many entries": (lambda: packed({f"{k}.stl": b"" for k in range(6_000)}), "6000 entries"),
    "encrypted": (encrypted, "without a password"),
    "a false size": (lying, "cannot be read"),
    "half a zip": (lambda: packed(FILES)[:-30], "cannot be read"),
    "an unfinished document": (lambda: packed({"a.xml": b"<!-- " * 200_000}), "no robot description"),
    "zeros": (lambda: b"PK\x03\x04" + bytes(1000), "cannot be read"),
    "another method": (lambda: packed(FILES, zipfile.ZIP_LZMA), "deflate"),
    "a long name": (lambda: packed({"n" * 5_000 + ".urdf": ARM.encode()}), "no robot description"),
}


def test_a_zip_that_is_too_large_is_not_opened(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "MAX_PACKED", 1_000)
    with pytest.raises(InputError, match="The zip has more than"):
        archive.unpack(packed(FILES, zipfile.ZIP_STORED), here)


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_zip_is_refused_in_one_sentence(here: Path, kind: str) -> None:
    make, words = HOSTILE[kind]
    data = make()
    before, began = {*here.rglob("*")}, time.monotonic()
    with pytest.raises(InputError, match=words) as told:
        load_urdf_text(data)
    assert len(str(told.value)) < 400
    assert str(told.value).isprintable()
    assert time.monotonic() - began < 100.0
    assert {*here.rglob("*")} == before
    assert not (here.parent / "evil.urdf").exists()


def test_links_in_a_zip_are_left_out(here: Path) -> None:
    (here / "secret.stl").write_bytes(ball())
    robot = load_urdf_text(with_link(str(here / "secret.stl")))
    assert "1 mesh file(s) not found" in str(robot.report.findings)
    assert not any(shape.name == "l2/0" for shape in link_shapes(robot))


def test_a_zip_uses_no_file_beside_its_own(here: Path) -> None:
    (here / "ball.stl").write_bytes(ball())
    for uri in (f"{here}/ball.stl", f"file://{here}/ball.stl", "../../../../../ball.stl"):
        robot = load_urdf_text(
            packed({"arm.urdf": ARM.replace("package://arm/meshes/ball.stl", uri).encode()})
        )
        assert "not found" in str(robot.report.findings)


def test_the_first_tag_of_a_document() -> None:
    for text, tag in (
        ('<?xml version="1.0"?>\n<!-- <robot> -->\n<mujoco model="a">', "mujoco"),
        ("\ufeff<robot name='a'/>", "robot"),
        ("<!DOCTYPE robot><robot/>", "robot"),
        ("no XML", ""),
        ("<!-- " * 200_000, ""),
        ("<!-- <a> -->" * 10_000 + "<mujoco>", "mujoco"),
    ):
        assert root_tag(text.encode()) == tag
