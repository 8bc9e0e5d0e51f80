"""Every malformed or malicious file is either imported as a robot that runs, or refused by one clear
sentence."""

from __future__ import annotations

import pickle
import struct
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import hostile
import numpy as np
import pytest
from arms import INERTIAL, link, two_joint_arm

from lessons.events import MoveTarget
from lessons.scenes.hold import _hold
from lessons.session.torque import TorqueSession
from robots import InputError, PlantSettings, Robot
from robots.covering import covers
from robots.covering.covered import Patch
from robots.covering.covering import covering
from robots.geometry import Capsule
from robots.loading.importing import import_robot
from robots.meshes.surfaces import read_meshes
from robots.processes.isolation import DEADLINE
from robots.shapes.link_shapes import MAX_TOTAL, link_shapes

READING = pytest.mark.nightly("robots/", "tests/robots/hostile.py")
DOCUMENTS = hostile.documents()
GROUPS = 8  # number of tests; with one test per kind there would be 400, most of them of one millisecond


@pytest.fixture(scope="module", autouse=True)
def equal_shapes_are_covered_once() -> Iterator[None]:
    """Capsules depend on surfaces and weights alone, and most kinds have the same surfaces."""
    known: dict[bytes, tuple[Capsule, ...]] = {}

    def remembered(surfaces: Sequence[Patch], weights: Mapping[int, float]) -> tuple[Capsule, ...]:
        key = pickle.dumps((surfaces, weights))
        if key not in known:
            known[key] = covering(surfaces, weights)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(covers, "covering", remembered)
        yield


@pytest.mark.parametrize("group", [pytest.param(k, marks=READING) if k > 1 else k for k in range(GROUPS)])
def test_every_kind_runs_or_is_refused_in_one_sentence(group: int) -> None:
    for kind in list(DOCUMENTS)[group::GROUPS]:
        began = time.process_time()
        result = import_robot(DOCUMENTS[kind], "my.urdf")
        assert time.process_time() - began < DEADLINE, kind
        assert len(result.report.findings) < 300, kind
        for finding in result.report.findings:
            assert len(str(finding)) < 400, kind
            assert str(finding).isprintable(), kind
        try:
            robot = result.used()
        except InputError as error:
            assert not result.report.usable, kind
            assert len(str(error)) < 400, kind
            assert str(error).isprintable(), kind
        else:
            assert result.report.usable, kind
            runs(robot, kind)
            looks_like_something(robot, kind)


def runs(robot: Robot, kind: str) -> None:
    session = TorqueSession(_hold(robot, PlantSettings()))
    for k in range(4):
        if k == 2:
            _, place = session.plant.frame_pose(robot.tip)
            session.post(MoveTarget("position", tuple(place + 0.1)))
        session.tick()
    for values in (session.plant.q, session.plant.v, session.plant.tau, robot.M_bar, robot.a_max):
        assert np.isfinite(values).all(), kind
    assert not session.notices, kind


def looks_like_something(robot: Robot, kind: str) -> None:
    shapes = link_shapes(robot)
    assert shapes, kind
    assert sum(len(shape.faces) for shape in shapes) < MAX_TOTAL + 100_000, kind
    for shape in shapes:
        assert np.isfinite(shape.vertices).all(), kind
        assert shape.faces.max() < len(shape.vertices), kind


def test_shapes_at_the_edge_of_what_numbers_can_be_are_left_out() -> None:
    for number in ("nan", "inf", "1e308", "-1e308"):
        robot = import_robot(hostile.visual(f'<sphere radius="{number}"/>').encode(), "my.urdf").used()
        assert not [shape for shape in link_shapes(robot) if shape.name.startswith("l2/")]


def stl(count: int, triangles: bytes) -> bytes:
    return bytes(80) + struct.pack("<I", count) + triangles


TRIANGLE = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
LAUGHS = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))
MESHES = {
    "empty.stl": b"",
    "empty.obj": b"",
    "empty.dae": b"",
    "half.stl": stl(2, TRIANGLE + TRIANGLE[:20]),
    "boast.stl": stl(4_000_000_000, TRIANGLE),
    "modest.stl": stl(0, TRIANGLE),
    "nan.stl": stl(1, struct.pack("<12fH", *[np.nan] * 12, 0)),
    "infinite.stl": stl(1, struct.pack("<12fH", 0, 0, 1, np.inf, 0, 0, 1, 0, 0, 0, 1, 0, 0)),
    "huge.stl": stl(1, struct.pack("<12fH", 0, 0, 1, 3e38, 0, 0, 1, 0, 0, 0, 1, 0, 0)),
    "words.stl": b"solid a\nfacet normal 0 0 1\nouter loop\nvertex a b c\n" * 100,
    "archive.stl": b"PK\x03\x04" + bytes(range(256)) * 10,
    "program.dae": b"\x7fELF" + bytes(1000),
    "bomb.dae": f'<!DOCTYPE c [<!ENTITY e0 "lol">{LAUGHS}]><COLLADA>&e9;</COLLADA>'.encode(),
    "outside.dae": b'<!DOCTYPE c [<!ENTITY x SYSTEM "file:///dev/zero">]><COLLADA>&x;</COLLADA>',
    "index.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999\nf -7 -8 -9\n",
    "nan.obj": b"v nan nan nan\nv inf 0 0\nv 1e400 1 0\nf 1 2 3\n",
    "library.obj": b"mtllib /etc/passwd\nusemtl x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "boast.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
    b"property float y\nproperty float z\nelement face 2000000000\nproperty list uchar int vertex_indices\n"
    b"end_header\n",
    "junk.glb": b"glTF\x02\x00\x00\x00\xff\xff\xff\xff" + bytes(100),
    "junk.gltf": b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "/dev/zero", "byteLength": 999999999}]}',
    "boast.off": b"OFF\n2000000000 2000000000 0\n",
    "picture.png": b"\x89PNG\r\n",
    "robot.urdf": two_joint_arm().encode(),
}


def test_bad_meshes_are_left_out(tmp_path: Path) -> None:
    """A separate process reads the meshes one by one, as in `link_shapes`; a bad mesh does not affect the
    others."""
    for name, content in MESHES.items():
        (tmp_path / name).write_bytes(content)
    good = stl(2, TRIANGLE + TRIANGLE)
    (tmp_path / "zz_good.stl").write_bytes(good)
    names = [*MESHES, "zz_good.stl"]
    visuals = "".join(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>' for name in names)
    arm = two_joint_arm(l2=link("l2", INERTIAL + visuals)).encode()
    robot = import_robot(arm, "my.urdf", tmp_path).used()
    looks_like_something(robot, "meshes")
    assert any(shape.name == "l2/0" for shape in link_shapes(robot))
    pieces = read_meshes(tuple(str(tmp_path / name) for name in names), 60.0)
    assert str(tmp_path / "zz_good.stl") in pieces
    for name in ("nan.stl", "infinite.stl", "nan.obj", "picture.png", "bomb.dae"):
        assert not pieces.get(str(tmp_path / name)), name
