"""Shapes of a robot are made with meshes and without."""

from __future__ import annotations

import dataclasses
import re
import time
from pathlib import Path

import numpy as np
import pytest
from arms import INERTIAL, link, load, two_joint_arm

from robots import CATALOG, Robot, load_robot
from robots.loading.imported import with_geometry
from robots.loading.importing import import_robot
from robots.meshes import surfaces
from robots.meshes.files import IN_EXTRA, RENAMED, find_mesh, installed_mesh, installed_shares
from robots.meshes.simplify import simplify
from robots.meshes.surfaces import MAX_FACES, mesh_pieces, read_meshes
from robots.shapes.link_shapes import MAX_TOTAL, Shape, link_shapes
from robots.urdf import canonicalise

FIELD = Path(__file__).parent / "field"
_MM = '<unit name="millimeter" meter="0.001"/>'


def check(robot: Robot, shapes: list[Shape]) -> None:
    assert shapes
    assert len({shape.name for shape in shapes}) == len(shapes)
    for shape in shapes:
        assert 0 <= shape.joint < robot.model.njoints
        assert shape.vertices.dtype == np.float32
        assert np.all(np.isfinite(shape.vertices))
        assert shape.vertices.shape[1] == shape.faces.shape[1] == 3
        assert shape.faces.min() >= 0
        assert shape.faces.max() < len(shape.vertices)
        assert all(0 <= channel <= 255 for channel in shape.colour)
        assert np.abs(shape.vertices).max() < 2.0


@pytest.mark.parametrize("name", CATALOG)
def test_catalog_robots_can_be_drawn(name: str) -> None:
    robot = load_robot(name)
    check(robot, link_shapes(robot))


@pytest.mark.parametrize("name", CATALOG)
def test_without_meshes_every_joint_is_drawn_as_capsules(name: str) -> None:
    robot = load_robot(name)
    bare = dataclasses.replace(
        robot, urdf_text=re.sub(r"<visual>.*?</visual>", "", robot.urdf_text, flags=re.S)
    )
    shapes = link_shapes(bare)
    check(bare, shapes)
    assert {shape.joint for shape in shapes} >= set(range(1, robot.n + 1))


def test_a_broken_mesh_falls_back_to_capsules(tmp_path) -> None:
    for suffix in (".dae", ".stl", ".obj"):
        mesh = tmp_path / f"broken{suffix}"
        mesh.write_bytes(b"\x00not a mesh")
        visual = f'<link name="l2"><visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>'
        robot = import_robot(two_joint_arm(l2=visual).encode(), "arm.urdf", tmp_path).used()
        assert str(mesh) in robot.urdf_text
        check(robot, link_shapes(robot))


def test_primitives_and_colours() -> None:
    visual = (
        '<link name="l2"><visual><origin xyz="0 0 1"/><geometry><box size="0.1 0.2 0.4"/></geometry>'
        '<material name="m"><color rgba="1 0 0.5 1"/></material></visual></link>'
    )
    robot = load(two_joint_arm(l2=visual))
    (box,) = (shape for shape in link_shapes(robot) if shape.name.startswith("l2"))
    assert box.colour == (238, 0, 128)
    np.testing.assert_allclose(np.ptp(box.vertices, axis=0), [0.1, 0.2, 0.4], atol=1e-6)
    np.testing.assert_allclose(box.vertices.mean(axis=0), [0, 0, 1], atol=1e-6)
    assert len(box.vertices) == 24


def test_simplified_surfaces_stay_where_they_were() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=5)
    vertices, faces = simplify(np.asarray(ball.vertices), np.asarray(ball.faces), 3000)
    assert 1000 < len(faces) <= 3000
    radii = np.linalg.norm(vertices, axis=1)
    assert radii.min() > 0.98
    assert radii.max() < 1.001


def test_meshes_are_light_enough() -> None:
    for name in CATALOG:
        robot = load_robot(name)
        counts: dict[str, int] = {}
        for shape in link_shapes(robot):
            link = shape.name.split("/")[0]
            counts[link] = counts.get(link, 0) + len(shape.faces)
        assert max(counts.values()) <= 1.2 * MAX_FACES
        assert sum(counts.values()) < MAX_TOTAL


def test_meshes_are_found_beside_the_urdf_and_in_its_packages(tmp_path) -> None:
    package = tmp_path / "my_robot"
    (package / "meshes").mkdir(parents=True)
    (package / "urdf").mkdir()
    mesh = package / "meshes" / "a.stl"
    mesh.write_bytes(b"")
    folder = package / "urdf"
    assert find_mesh("package://my_robot/meshes/a.stl", folder) == mesh
    assert find_mesh("../meshes/a.stl", folder) == mesh
    assert find_mesh(f"file://{mesh}", folder) == mesh
    for nothing in (
        "",
        "package://other/meshes/a.stl",
        "package://my_robot/../../etc/passwd",
        "http://x/a.stl",
    ):
        assert find_mesh(nothing, folder) is None


def test_a_folder_stands_in_for_a_package_of_another_name() -> None:
    robot = load_robot(FIELD / "renamed_package" / "urdf" / "arm.urdf")
    part = FIELD / "renamed_package" / "meshes" / "part.dae"
    assert robot.urdf_text.count(f'"{part}"') == 4
    told = str(robot.report.findings)
    assert "the folder 'renamed_package' stood in for the package 'arm_description'" in told
    assert "not found" not in told


def test_where_a_mesh_is_looked_for_at_last(tmp_path) -> None:
    """Without the package's name, then in the folder `meshes` beside the URDF; never outside `within`."""
    for name in ("own/robot/urdf", "own/robot/meshes/fine", "own/parts"):
        (tmp_path / name).mkdir(parents=True)
    for name in (
        "own/robot/meshes/a.stl",
        "own/robot/urdf/b.stl",
        "own/parts/c.stl",
        "d.stl",
        "own/robot/meshes/fine/e.stl",
    ):
        (tmp_path / name).write_bytes(b"solid a")
    own = tmp_path / "own"
    for uri, there in (
        ("package://x/meshes/a.stl", True),
        ("package://x/visual/fine/a.stl", True),
        ("file:///home/somebody/ws/a.stl", True),
        ("C:\\somebody\\b.stl", True),
        ("package://x/parts/c.stl", True),
        ("file:///opt/ros/jazzy/share/x/meshes/fine/e.stl", True),
        ("/home/somebody/ws/x/meshes/fine/e.stl", True),
        ("file://$(find x)/meshes/fine/e.stl", True),
        ("package://x/meshes/fine/e%2estl", True),
        ("package://x/../../../d.stl", False),
        ("package://x/d.stl", False),
        ("package://x/nowhere.stl", False),
    ):
        arm = two_joint_arm(l2=mesh_visual(uri)).encode()
        robot = import_robot(arm, "arm.urdf", own / "robot" / "urdf", within=own).used()
        told = str(robot.report.findings)
        assert ("mesh filename" in robot.urdf_text) is there, uri
        assert ("stood in for" in told) is there, uri
        assert ("the folder of the URDF and all folders above it" in told) is not there, uri


def test_the_extra_is_recommended_only_if_it_has_the_package() -> None:
    for package, helps in (("panda_description", True), ("arm_description", False)):
        told = canonicalise(
            two_joint_arm(l2=mesh_visual(f"package://{package}/none.stl")).encode(), "a.urdf"
        )[1]
        assert ("himpc-lab[meshes]" in str(told)) is helps
    installed = [place.name for share in installed_shares() for place in share.iterdir() if place.is_dir()]
    if installed:
        assert {*installed, *RENAMED}.issuperset(IN_EXTRA.split())


def mesh_visual(uri: str) -> str:
    return link("l2", f'{INERTIAL}<visual><geometry><mesh filename="{uri}"/></geometry></visual>')


def a_ball(path) -> None:
    import trimesh

    trimesh.creation.icosphere(subdivisions=1).export(path)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        ('<unit name="millimeter" meter="0.001"/>', 1e-3),
        ('<unit name="inch" meter="0.0254"/>', 0.0254),
        ("", 1.0),
    ],
    ids=["mm", "inch", "none"],
)
def test_the_unit_of_a_collada_file_is_applied_before_the_scale(tmp_path, unit: str, metres: float) -> None:
    text = (FIELD / "tetra_mm.dae").read_text()
    (tmp_path / "part.dae").write_text(text.replace(_MM, unit))
    mesh = mesh_visual("part.dae").replace('.dae"', '.dae" scale="1 2 0.5"')
    robot = import_robot(two_joint_arm(l2=mesh).encode(), "arm.urdf", tmp_path).used()
    (part,) = (shape for shape in link_shapes(robot) if shape.name.startswith("l2/"))
    extents = np.ptp(part.vertices, axis=0)
    np.testing.assert_allclose(extents, metres * np.array([50.0, 100.0, 150.0]), rtol=1e-5)


def test_meshes_in_millimetres_of_a_file_as_it_was_found_are_drawn_in_metres() -> None:
    robot = load_robot(FIELD / "dae_in_mm.urdf")
    sizes = [np.ptp(shape.vertices, axis=0).max() for shape in link_shapes(robot)]
    assert len(sizes) == 4
    np.testing.assert_allclose(sizes, 0.3)


def test_a_mesh_that_is_far_larger_than_the_robot_is_reported(tmp_path) -> None:
    """An STL has no unit. Millimetres that are read as metres are drawn 1000 times too large."""
    import trimesh

    trimesh.creation.box((60.0, 80.0, 300.0)).export(tmp_path / "part.stl")
    for scale, reported in (("", True), (' scale="0.001 0.001 0.001"', False)):
        mesh = mesh_visual("part.stl").replace('.stl"', f'.stl"{scale}')
        (tmp_path / "arm.urdf").write_text(two_joint_arm(l2=mesh))
        told = str(load_robot(tmp_path / "arm.urdf").report.findings)
        assert ("its meshes are 300 m large" in told) is reported
        assert ("no unit" in told) is reported


def test_the_table_of_other_peoples_robots_shows_meshes_of_a_wrong_size(tmp_path) -> None:
    """The largest link of a robot is neither 50 times smaller nor five times larger than the arm."""
    import trimesh

    from benchmarks.field import Tried, summary

    trimesh.creation.box((0.06, 0.08, 0.3)).export(tmp_path / "part.stl")
    rows = []
    for scale in (1.0, 1000.0, 0.001):
        mesh = mesh_visual("part.stl").replace('.stl"', f'.stl" scale="{scale} {scale} {scale}"')
        (tmp_path / "arm.urdf").write_text(two_joint_arm(l2=mesh))
        report = load_robot(tmp_path / "arm.urdf").report
        assert report.drawn == pytest.approx(scale * 0.3 / (2 * np.hypot(0.3, 0.1)), rel=1e-3)
        assert ("the largest link is drawn 0.3 mm large" in str(report.findings)) is (scale < 1.0)
        rows.append(Tried(f"{scale:g}.urdf", True, True, report.drawn, ("", "", "", "")))
    assert load(two_joint_arm()).report.drawn is None
    assert summary(rows).endswith(
        "2 of 3 robots with meshes are drawn at a wrong size ('1000.urdf', '0.001.urdf')."
    )


def test_the_wall_clock_drops_no_mesh(tmp_path, monkeypatch) -> None:
    """On a slow or busy machine reading takes long; only processor time counts."""
    a_ball(tmp_path / "ball.stl")
    hours = iter(range(0, 10**6, 3600))
    monkeypatch.setattr(time, "monotonic", lambda: next(hours))
    assert len(read_meshes((str(tmp_path / "ball.stl"),), 7.0)) == 1


def test_meshes_that_were_not_read_are_named(tmp_path, monkeypatch) -> None:
    a_ball(tmp_path / "ball.stl")
    (tmp_path / "broken.stl").write_bytes(b"solid a")
    both = mesh_visual("broken.stl").replace("</link>", mesh_visual("ball.stl").split(INERTIAL)[1])
    (tmp_path / "arm.urdf").write_text(two_joint_arm(l2=both))
    told = str(load_robot(tmp_path / "arm.urdf").report.findings)
    assert "1 mesh file(s) could not be read ('broken.stl')" in told
    robot = import_robot((tmp_path / "arm.urdf").read_bytes(), "arm.urdf", tmp_path).used()
    monkeypatch.setattr(surfaces, "READING", 0.0)
    told = str(with_geometry(robot).report.findings)
    assert "2 mesh file(s) could not be read ('broken.stl', 'ball.stl')" in told


def test_the_owner_of_the_machine_uses_meshes_beside_a_urdf(tmp_path) -> None:
    a_ball(tmp_path / "ball.stl")
    arm = two_joint_arm(l2=mesh_visual("ball.stl")).encode()
    robot = import_robot(arm, "arm.urdf", tmp_path).used()
    assert {len(shape.faces) for shape in link_shapes(robot) if shape.name == "l2/0"} == {80}


def test_an_uploaded_urdf_sees_no_file_of_the_server(tmp_path, monkeypatch) -> None:
    """A mesh with a relative, absolute or file:// path counts as missing, whether its file exists or not."""
    package = tmp_path / "my_robot"
    package.mkdir()
    a_ball(package / "ball.stl")
    monkeypatch.chdir(package)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    for there, absent in (
        ("ball.stl", "none.stl"),
        (f"{package}/ball.stl", f"{package}/none.stl"),
        (f"file://{package}/ball.stl", f"file://{package}/none.stl"),
        ("package://my_robot/ball.stl", "package://my_robot/none.stl"),
    ):
        texts = []
        for uri in (there, absent):
            robot = load(two_joint_arm(l2=mesh_visual(uri)))
            assert "mesh" not in robot.urdf_text
            texts.append(str(robot.report.findings).replace("none.stl", "ball.stl"))
            check(robot, link_shapes(robot))
        assert texts[0] == texts[1]
        assert "not found" in texts[0]


def test_a_package_name_does_not_lead_out_of_the_installed_packages() -> None:
    for share in installed_shares():
        for uri in ("package://../x", "package://./x", "package://a/../../x", "package:///etc/passwd"):
            assert installed_mesh(uri) is None, share


def test_an_uploaded_urdf_sees_the_meshes_of_installed_packages() -> None:
    files = [(s, f) for s in installed_shares() for f in s.glob("*_description/meshes/**/*.stl")]
    if not files:
        pytest.skip("no mesh package is installed: pip install himpc-lab[meshes]")
    share, file = files[0]
    uri = f"package://{file.relative_to(share)}"
    robot = load(two_joint_arm(l2=mesh_visual(uri)))
    assert uri in robot.urdf_text
    assert str(share) not in robot.urdf_text
    assert mesh_pieces([uri])
    assert any(shape.name == "l2/0" for shape in link_shapes(robot))
