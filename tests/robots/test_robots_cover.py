"""The capsules with which distances are computed contain the drawn shapes and the collision solids of the
plant."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from arms import INERTIAL, joint, link, load, two_joint_arm
from arms import robot as urdf
from hypothesis import given, settings
from hypothesis import strategies as st

from robots import CATALOG, Robot, load_robot, load_urdf_text
from robots.covering.cover_of import cover_of
from robots.covering.covered import patches
from robots.covering.covers import as_solid, made_cover
from robots.geometry import Cover, as_json, stored
from robots.mechanics.exclusions import touching
from robots.shapes.link_shapes import link_shapes

ROUNDING = 1e-7  # m; drawn vertices are float32


def outside(cover: Cover, joint: int, points: np.ndarray) -> float:
    """Returns how far the farthest of points (V, 3), in the axes of a joint, lies outside of all its
    capsules, m."""
    least = np.full(len(points), np.inf)
    for capsule in cover.capsules:
        if capsule.joint == joint:
            start, axis = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
            along = np.clip((points - start) @ axis / max(axis @ axis, 1e-300), 0.0, 1.0)
            gaps = np.linalg.norm(points - start - along[:, None] * axis, axis=1) - capsule.radius
            least = np.minimum(least, gaps)
    return float(least.max())


def worst(robot: Robot) -> float:
    """Returns how far surfaces of the solids and of the visual shapes protrude from the cover, m."""
    cover = cover_of(robot)
    return max(outside(cover, patch.joint, on(patch.corners)) + patch.swell for patch in patches(robot))


def on(corners: np.ndarray) -> np.ndarray:
    """Returns points of triangles (F, 3, 3): their corners, and points inside."""
    inner = np.random.default_rng(0).dirichlet((1.0, 1.0, 1.0), 20)
    between = np.concatenate([np.eye(3), inner]) @ corners[:: max(1, len(corners) // 2000)]
    return np.concatenate([corners.reshape(-1, 3), between.reshape(-1, 3)])


@pytest.mark.parametrize("name", CATALOG)
def test_the_stored_cover_contains_the_robot(name: str) -> None:
    """The capsules contain every vertex of the meshes and every point on the surfaces of the collision
    solids."""
    robot = load_robot(name)
    cover = cover_of(robot)
    for patch in patches(replace(robot, urdf_text='<robot name="bare"/>')):
        assert outside(cover, patch.joint, on(patch.corners)) + patch.swell <= ROUNDING, patch.link
    shapes = link_shapes(robot)
    if any(shape.name.startswith("body") for shape in shapes):
        return  # without meshes capsules are drawn; their drums at the joints are only decoration
    for shape in shapes:
        assert outside(cover, shape.joint, shape.vertices.astype(float)) <= ROUNDING, shape.name


@pytest.mark.parametrize("name", CATALOG)
def test_a_thinner_cover_would_not_contain_it(name: str) -> None:
    """If the capsules are 2 mm thinner, surfaces of every body protrude from them."""
    robot = load_robot(name)
    cover = cover_of(robot)
    thinner = tuple(replace(each, radius=each.radius - 2e-3) for each in cover.capsules)
    found = {patch.joint: -np.inf for patch in patches(robot)}
    for patch in patches(robot):
        out = outside(replace(cover, capsules=thinner), patch.joint, patch.corners.reshape(-1, 3))
        found[patch.joint] = max(found[patch.joint], out + patch.swell)
    assert min(found.values()) > 5e-4


MOST = {"planar3": 12, "iiwa14": 20, "panda": 20, "ridgeback-ur10": 26, "baxter": 40}


@pytest.mark.parametrize("name", CATALOG)
def test_few_capsules_are_far_apart_at_home(name: str) -> None:
    """Every tick computes all distances, so capsules must be few. A pair that touches at home could not keep
    a distance, so only excluded pairs touch."""
    robot = load_robot(name)
    cover = cover_of(robot)
    assert {capsule.joint for capsule in cover.capsules} == {each.joint for each in robot.collision.solids}
    assert len(cover.capsules) <= MOST[name]
    plant = {(pair.first, pair.second) for pair in robot.collision.excluded}
    assert plant <= {(pair.first, pair.second) for pair in cover.excluded}
    solids = tuple(map(as_solid, cover.capsules))
    covered = replace(robot, collision=replace(robot.collision, solids=solids, excluded=cover.excluded))
    assert not touching(covered, robot.home, 0.01)


def test_the_stored_cover_is_the_generated_one() -> None:
    """A cover that is generated as by `python -m robots.loading.write` equals the stored cover."""
    robot = load_robot("planar3")
    assert made_cover(robot, tries=2) == robot.cover


def test_a_stored_cover_survives_its_file(tmp_path: Path) -> None:
    cover = cover_of(load_robot("panda"))
    path = tmp_path / "cover.json"
    path.write_text(as_json(cover))
    assert stored(Cover, path) == cover
    assert json.loads(path.read_text())["capsules"]


SHAPES = (
    '<box size="0.1 0.2 0.3"/>',
    '<cylinder radius="0.05" length="0.4"/>',
    '<sphere radius="0.12"/>',
)


def with_shapes(*shapes: str, tag: str = "visual", at: str = "0.1 0 0.05") -> Robot:
    inside = "".join(
        f'<{tag}><origin xyz="{at}" rpy="0.3 0.2 0.1"/><geometry>{shape}</geometry></{tag}>'
        for shape in shapes
    )
    return load(two_joint_arm(l2=link("l2", INERTIAL + inside)))


@pytest.mark.parametrize("tag", ["visual", "collision"])
def test_primitives_are_contained(tag: str) -> None:
    """The cover of one shape and of three shapes contains all drawn vertices, and the exact sphere and
    cylinder."""
    for shapes in (SHAPES[:1], SHAPES):
        robot = with_shapes(*shapes, tag=tag)
        assert worst(robot) <= 1e-9
        for shape in link_shapes(robot):
            if shape.name.startswith("l2/"):
                assert outside(cover_of(robot), shape.joint, shape.vertices.astype(float)) <= ROUNDING


def test_a_sphere_is_its_own_cover() -> None:
    capsules = [each for each in cover_of(with_shapes(SHAPES[2])).capsules if each.link == "l2"]
    (ball,) = capsules
    assert ball.start == ball.end
    assert 0.12 <= ball.radius < 0.1203


def test_a_robot_without_shapes_has_the_capsules_of_its_kinematics() -> None:
    """The capsules cover the straight parts from joint to joint; each is one capsule, as thick as the drawn
    one."""
    robot = load(two_joint_arm())
    cover = cover_of(robot)
    assert worst(robot) <= 1e-9
    limbs = [solid for solid in robot.collision.solids if solid.kind == "capsule"]
    assert limbs
    for solid in limbs:
        (capsule,) = [each for each in cover.capsules if each.joint == solid.joint]
        assert solid.size[0] <= capsule.radius < solid.size[0] + 3e-4


sizes = st.floats(0.01, 1.0)
shapes = st.one_of(
    st.builds('<box size="{:.3f} {:.3f} {:.3f}"/>'.format, sizes, sizes, sizes),
    st.builds('<cylinder radius="{:.3f}" length="{:.3f}"/>'.format, sizes, sizes),
    st.builds('<sphere radius="{:.3f}"/>'.format, sizes),
)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.lists(shapes, min_size=1, max_size=4), st.sampled_from(["visual", "collision"]), sizes)
def test_random_shapes_are_contained(found: list[str], tag: str, at: float) -> None:
    robot = with_shapes(*found, tag=tag, at=f"{at:.3f} 0 0")
    cover = cover_of(robot)
    assert worst(robot) <= 1e-9
    assert len(cover.capsules) <= 12
    assert all(np.isfinite((*each.start, *each.end, each.radius)).all() for each in cover.capsules)


BOX = '<visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual>'
HOSTILE = {
    "negative": BOX.replace("0.1 0.2 0.3", "-1 0.2 0.3"),
    "words": BOX.replace("0.1 0.2 0.3", "wide 0.2 0.3"),
    "huge": BOX.replace("0.1 0.2 0.3", "1e300 1 1"),
    "large": BOX.replace("0.1 0.2 0.3", "900 900 900"),
    "tiny": BOX.replace("0.1 0.2 0.3", "3e-5 3e-5 3e-5"),
    "flat": BOX.replace("0.1 0.2 0.3", "900 900 3e-5"),
    "nan": BOX.replace("0.1 0.2 0.3", "nan nan nan"),
    "far": BOX.replace("<geometry>", '<origin xyz="0 0 990"/><geometry>'),
    "no geometry": "<visual/>",
    "many": BOX * 3000,
    "missing mesh": '<visual><geometry><mesh filename="nowhere.stl" scale="nan"/></geometry></visual>',
}


@pytest.mark.parametrize("case", HOSTILE)
def test_bad_shapes_cost_no_distance(case: str) -> None:
    """The robot has few capsules. All are finite, and they contain the shapes that can be used."""
    robot = load(two_joint_arm(l2=link("l2", INERTIAL + HOSTILE[case])))
    cover = cover_of(robot)
    assert 1 <= len(cover.capsules) <= 12
    assert all(np.isfinite((*each.start, *each.end, each.radius)).all() for each in cover.capsules)
    assert worst(robot) <= 1e-9


def test_the_import_report_tells_of_the_cover() -> None:
    """The report contains the number of capsules, and the pairs whose distance is not kept."""
    names = [f"l{k}" for k in range(4)]
    joints = [joint(f"j{a}", a, b) for a, b in pairwise(names)]
    robot = load_urdf_text(urdf(*map(link, names), *joints))
    assert robot.cover is not None
    (finding,) = [each for each in robot.report.findings if each.where == "distances"]
    assert finding.text == str(robot.cover)
    assert f"{len(robot.cover.capsules)} capsules" in finding.text
    near = [pair for pair in robot.cover.excluded if pair.why == "neighbours"]
    assert f"{len(near)} pair(s) of neighbours" in finding.text


PLATE = '<collision><geometry><box size="2 2 0.01"/></geometry></collision>'
BELOW = '<collision><origin xyz="0 0 -0.15"/><geometry><sphere radius="0.005"/></geometry></collision>'
STILL = '<limit lower="-0.001" upper="0.001" velocity="3" effort="50"/>'


def test_bodies_that_only_their_capsules_join_are_left_out() -> None:
    """A small ball is near a large plate. The bodies do not touch, but the capsules of the plate contain the
    ball in all postures; therefore the pair is excluded."""
    text = urdf(
        link("base", PLATE),
        link("l1"),
        link("l2", INERTIAL + BELOW),
        joint("j1", "base", "l1", inside=STILL),
        joint("j2", "l1", "l2", inside=STILL),
    )
    robot = load(text)
    pairs = {pair.names: pair.why for pair in cover_of(robot).excluded}
    assert ("base", "l2") not in {pair.names for pair in robot.collision.excluded}
    assert pairs["base", "l2"] == "home"


def test_links_that_no_distance_keeps_apart_pass_through_each_other() -> None:
    """The hull of a link's shape is often thicker than the link, so that a body two joints further touches
    it. Nothing keeps these two apart, and the controller would press one against the other. A base is no such
    link: it may be a table."""
    names = ["base", "l1", "l2", "l3"]
    inside = [PLATE, INERTIAL + PLATE, INERTIAL + BELOW, INERTIAL + BELOW]
    joints = [joint(f"j{a}", a, b, inside=STILL) for a, b in pairwise(names)]
    robot = load_urdf_text(urdf(*map(link, names, inside), *joints))
    left_out = {pair.names for pair in robot.collision.excluded if pair.why != "neighbours"}
    apart = {pair.names for pair in cover_of(robot).excluded if pair.why != "neighbours"}
    assert apart == {("base", "l2"), ("l1", "l3")}
    assert left_out == {("l1", "l3")}
    texts = [each.text for each in robot.report.findings if each.where == "contacts"]
    assert texts[-1].startswith("l1 – l3: these links pass through each other")
