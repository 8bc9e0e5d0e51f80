"""A plant with geometry computes contacts and joint stops, with the collision solids of its robot."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from arms import INERTIAL, joint, link
from arms import robot as urdf
from scipy.spatial import ConvexHull

from robots import CATALOG, Ball, Box, Floor, InputError, Plant, PlantSettings, Robot, load_robot
from robots.floor import standing_floor
from robots.geometry import CollisionModel, as_json, stored
from robots.loading.importing import import_robot
from robots.loading.write import made
from robots.mechanics.exclusions import touching
from robots.mechanics.model import compiled
from robots.shapes.link_shapes import link_shapes
from robots.world import Post, Thing, World, table

TOUCHING = PlantSettings(contacts=True, joint_stops=True)


@pytest.mark.parametrize("name", CATALOG)
def test_nothing_touches_at_home(name: str) -> None:
    """A robot that is held at home has no contact, and its positions equal those without contacts to the last
    bit."""
    robot = load_robot(name)
    plants = Plant(robot), Plant(robot, TOUCHING, world=standing_floor(robot))
    for plant in plants:
        for _ in range(50):
            plant.step(plant.holding_torque(), 1e-3)
            assert plant.touch == (0.0, 0.0)
    assert robot.collision.solids
    np.testing.assert_array_equal(plants[0].q, plants[1].q)


@pytest.mark.parametrize("name", ["baxter", "ridgeback-ur10"])
def test_what_touches_at_home_is_excluded_and_told(name: str) -> None:
    """Without the list of excluded pairs, the links of these robots would press against each other at
    home."""
    robot = load_robot(name)
    pairs = [pair for pair in robot.collision.excluded if pair.why == "home"]
    found = replace(robot, collision=replace(robot.collision, excluded=()))
    assert {(pair.first, pair.second) for pair in pairs} <= touching(found, robot.home, 2e-3)
    assert not touching(robot, robot.home)
    for pair in pairs:
        assert " – ".join(pair.names) in str(robot.collision)


FALLING = {"iiwa14": np.radians([0, 60, 0, -30, 0, 30, 0]), "panda": np.radians([0, 60, 0, -60, 0, 90, 45])}


@pytest.mark.parametrize("name", FALLING)
def test_an_arm_that_falls_stays_above_the_floor(name: str) -> None:
    """The arm has no torque and lies on the floor in the end; the penetration is never deeper than 5 mm."""
    robot = load_robot(name)
    plant = Plant(robot, replace(TOUCHING, damping=2.0), world=standing_floor(robot))
    plant.reset(FALLING[name], tau=np.zeros(robot.n))
    depth, felt, through = 0.0, 0, Plant(robot, PlantSettings(damping=2.0))
    through.reset(FALLING[name], tau=np.zeros(robot.n))
    for _ in range(2000):
        for each in (plant, through):
            each.step(np.zeros(robot.n), 1e-3)
        depth, felt = max(depth, plant.touch.depth), felt + (plant.touch.force > 0.0)
    assert 0.0 < depth < 5e-3
    assert plant.touch.depth < 1e-3
    assert felt > 500
    assert not plant.broken
    assert np.abs(plant.v).max() < 0.2
    assert plant.frame_pose(robot.tip)[1][2] > 0.0 > through.frame_pose(robot.tip)[1][2]
    weight = sum(float(contact.force[2]) for contact in plant.contacts)
    assert all(contact.between[0] == "floor" for contact in plant.contacts)
    assert weight > 5.0  # the floor carries the arm


def test_a_changed_diagonal_does_not_hide_contacts() -> None:
    """Our own code integrates a plant with a changed diagonal, and the arm lies on the floor in the same
    way."""
    robot = load_robot("panda")
    plant = Plant(robot, replace(TOUCHING, damping=2.0, diagonal_scale=1.1), world=standing_floor(robot))
    plant.reset(FALLING["panda"], tau=np.zeros(robot.n))
    depth, felt = 0.0, 0
    for _ in range(700):
        plant.step(np.zeros(robot.n), 1e-3)
        depth, felt = max(depth, plant.touch.depth), felt + (plant.touch.force > 0.0)
    assert felt > 50
    assert 0.0 < depth < 5e-3
    assert plant.frame_pose(robot.tip)[1][2] > 0.0


def test_the_links_of_a_robot_touch_each_other() -> None:
    """The forearm is folded without joint stops until the upper arm stops it; the contact names both
    links."""
    plant = Plant(load_robot("iiwa14"), PlantSettings(contacts=True))
    for _ in range(1500):
        torque = plant.holding_torque()
        torque[3] += 20.0
        plant.step(torque, 1e-3)
    assert {contact.between for contact in plant.contacts} == {("link_3", "link_5")}
    assert 2.4 < plant.q[3] < 2.5


@pytest.mark.parametrize("stops", [True, False])
def test_a_joint_stops_at_its_limit(stops: bool) -> None:
    """With stops, the motor torque cannot push the joint beyond its limit; without stops, the joint moves
    on."""
    robot = load_robot("iiwa14")
    plant = Plant(robot, PlantSettings(joint_stops=stops, gravity=False))
    for _ in range(1500):
        plant.step(np.array([0, 0, 0, 0, 0, 0, 5.0]), 1e-3)
    over = plant.q[6] - robot.q_upper[6]
    assert over < np.radians(0.5) if stops else over > 1.0


def test_without_contacts_the_model_is_as_before(tmp_path: Path) -> None:
    """Without contacts the model contains only the joints, sites and motors of the robot: no geometry, no
    limit and no other body; MuJoCo's contacts are disabled."""
    world: World = (Thing(Floor()), Thing(Ball("ball", (1.0, 0.0, 1.0), 0.1), mass_kg=1.0))
    for name in CATALOG:
        robot = load_robot(name)
        bare = compiled(replace(robot, collision=type(robot.collision)()), PlantSettings())
        model = compiled(robot, PlantSettings(), world)
        assert (model.ngeom, model.nbody, model.nq) == (0, robot.n + 1, robot.n)
        assert not model.jnt_limited.any()
        assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
        texts = []
        for each in (bare, model):
            mujoco.mj_saveModel(each, str(tmp_path / "model.mjb"))
            texts.append((tmp_path / "model.mjb").read_bytes())
        assert texts[0] == texts[1]


def test_free_objects_move_and_return() -> None:
    """A ball and a box fall on a table and stay there, and a reset puts them back. The quantities of the
    robot keep their length n."""
    robot = load_robot("iiwa14")
    world: World = (
        *standing_floor(robot),
        table("table", (1.2, 0.0), (0.6, 0.6), 0.4),
        Thing(Post("post", (0.0, 1.0, 0.0), 1.0, 0.05)),
        Thing(Ball("ball", (1.2, 0.0, 0.6), 0.05), mass_kg=0.5),
        Thing(Box("box", (1.2, 0.2, 0.6), (0.1, 0.1, 0.1), 0.3), mass_kg=0.5),
    )
    plant = Plant(robot, TOUCHING, world=world)
    start = plant.objects()
    for _ in range(1000):
        plant.step(plant.holding_torque(), 1e-3)
    np.testing.assert_allclose(plant.objects()[:, :3], [(1.2, 0.0, 0.45), (1.2, 0.2, 0.45)], atol=2e-3)
    assert plant.touch == (0.0, 0.0)
    assert plant.q.shape == plant.v.shape == plant.bias().shape == (7,)
    assert plant.mass_matrix().shape == (7, 7)
    assert plant.jacobian("flange").shape == (6, 7)
    np.testing.assert_array_equal(plant.q, robot.home)
    plant.configure(PlantSettings())
    np.testing.assert_array_equal(plant.objects(), start)
    plant.configure(TOUCHING)
    plant.reset(robot.home)
    np.testing.assert_array_equal(plant.objects(), start)


def test_contacts_can_be_switched_while_the_robot_moves() -> None:
    robot = load_robot("panda")
    plant = Plant(robot, PlantSettings(), world=standing_floor(robot))
    q, v = plant.q, plant.v
    for k in range(60):
        if k == 30:
            plant.configure(TOUCHING)
            q, v = plant.q, plant.v
        plant.step(np.zeros(7), 1e-3)
        if k == 30:
            assert np.abs(plant.q - q - 1e-3 * v).max() < 1e-3


@pytest.mark.parametrize("value", ["yes", 1, None, float("nan")])
@pytest.mark.parametrize("name", ["contacts", "joint_stops"])
def test_settings_that_are_no_choice_are_refused(name: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"plant\.{name} is .*; give true or false\."):
        PlantSettings(**{name: value})  # pyright: ignore[reportArgumentType]


def test_worlds_that_cannot_be_are_refused() -> None:
    robot = load_robot("planar3")
    ball = Thing(Ball("ball", (1.0, 0.0, 1.0), 0.1), mass_kg=1.0)
    with pytest.raises(InputError, match="two objects of the world are called 'ball'"):
        Plant(robot, TOUCHING, world=(ball, ball))
    with pytest.raises(InputError, match="give at most 50"):
        Plant(robot, TOUCHING, world=(ball,) * 51)
    with pytest.raises(InputError, match=r"diagonal_scale and plant\.contacts cannot be combined"):
        Plant(robot, replace(TOUCHING, diagonal_scale=0.9), world=(ball,))
    with pytest.raises(InputError, match="object 'ball': mass_kg is -1"):
        Thing(ball.shape, mass_kg=-1.0)
    with pytest.raises(InputError, match="a floor is static"):
        Thing(Floor(), mass_kg=1.0)
    with pytest.raises(InputError, match="post 'p' needs"):
        Post("p", (0.0, 0.0, float("nan")), 1.0, 0.1)


def test_the_stored_solids_are_those_of_the_meshes() -> None:
    """The stored solids contain all drawn shapes, to 3 mm, and the excluded pairs are found again."""
    robot = load_robot("iiwa14")
    shapes = link_shapes(robot)
    if shapes[0].name.startswith("base/pedestal"):
        pytest.skip("the extra 'meshes' is not installed")
    again = made(CATALOG["iiwa14"])
    assert again.excluded == robot.collision.excluded
    hulls = {solid.link: ConvexHull(np.array(solid.points)).equations for solid in robot.collision.solids}
    for shape in shapes:
        planes = hulls[shape.name.rpartition("/")[0]]
        outside = (shape.vertices.astype(float) @ planes[:, :3].T + planes[:, 3]).max()
        assert outside < 3e-3, shape.name


def own(shapes: str) -> Robot:
    """Returns an arm of two links; the second has the given shapes."""
    text = urdf(
        link("base", ""),
        link("a"),
        link("b", INERTIAL + shapes),
        joint("j1", "base", "a"),
        joint("j2", "a", "b"),
    )
    return import_robot(text.encode(), "the URDF text").used()


BOX = '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'


def test_an_own_robot_gets_solids_and_a_line_in_the_report() -> None:
    """Collision shapes of the URDF are used first; bodies without any shape get capsules."""
    robot = own(BOX)
    kinds = {(solid.link, solid.kind, solid.source) for solid in robot.collision.solids}
    assert ("b", "box", "collision") in kinds
    assert any(source == "capsule" for _, _, source in kinds)
    (finding,) = [each for each in robot.report.findings if each.where == "contacts"]
    assert finding.text == str(robot.collision)
    assert "1 collision shape(s) of the URDF" in finding.text


HOSTILE = {
    "negative": BOX.replace("0.1 0.2 0.3", "-1 0.2 0.3"),
    "words": BOX.replace("0.1 0.2 0.3", "wide 0.2 0.3"),
    "huge": BOX.replace("0.1 0.2 0.3", "1e300 1 1"),
    "nan": BOX.replace("0.1 0.2 0.3", "nan nan nan"),
    "no geometry": "<collision/>",
    "far": BOX.replace("0 0 0.1", "0 0 1e9"),
    "many": BOX * 3000,
    "missing mesh": '<collision><geometry><mesh filename="nowhere.stl"/></geometry></collision>',
}


@pytest.mark.parametrize("case", HOSTILE)
def test_bad_collision_shapes_are_left_out(case: str) -> None:
    """The robot can still be used with contacts, and has few solids."""
    try:
        robot = own(HOSTILE[case])
    except InputError:
        assert case == "far"  # the importer refuses a robot of this size
        return
    assert 1 <= len(robot.collision.solids) <= 20
    plant = Plant(robot, TOUCHING)
    plant.step(plant.holding_torque(), 1e-3)
    assert not plant.broken


def test_stored_geometry_survives_its_file(tmp_path: Path) -> None:
    robot = load_robot("panda")
    path = tmp_path / "collision.json"
    path.write_text(as_json(robot.collision))
    assert stored(CollisionModel, path) == robot.collision
    assert json.loads(path.read_text())["solids"]
