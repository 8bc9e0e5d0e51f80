"""The import repairs, completes, fixes or refuses parts of a URDF, and reports each of these changes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from arms import INERTIAL, LIMIT, joint, link, load, robot, two_joint_arm

from robots import InputError, Robot, check_urdf, load_robot
from robots.joints import chain_length
from robots.loading.importing import import_robot
from robots.mechanics.exclusions import lowest
from robots.meshes.files import installed_shares
from robots.report import Kind
from robots.shapes.read import described_shapes


def texts(loaded: Robot, kind: Kind) -> str:
    return " | ".join(str(finding) for finding in loaded.report.of_kind(kind))


def inertial(mass: str, moments: str) -> str:
    xx, yy, zz = moments.split()
    moments_text = f'ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"'
    return f'<inertial><mass value="{mass}"/><inertia {moments_text}/></inertial>'


def test_a_clean_urdf_has_nothing_to_report() -> None:
    loaded = load(two_joint_arm())
    assert [finding.where for finding in loaded.report.findings] == ["rotors", "contacts", "floor"]
    assert loaded.report.usable
    np.testing.assert_array_equal(loaded.q_upper, [2, 2])
    np.testing.assert_array_equal(loaded.v_limit, [3, 3])
    np.testing.assert_array_equal(loaded.tau_limit, [50, 50])
    assert np.all((loaded.home > loaded.q_lower) & (loaded.home < loaded.q_upper))


def test_a_tool_is_a_frame_at_its_place_on_the_tip() -> None:
    """Also on a tip that is chosen by the program, on one of a robot of the catalog, and beside a link with
    the tool's name."""
    arm = two_joint_arm()
    bare = load(arm)
    place = pin.SE3(pin.rpy.rpyToMatrix(0.1, -0.2, 0.3), np.array([0.1, 0.0, -0.05]))
    where = "0.1,0,-0.05,0.1,-0.2,0.3"
    of_catalog = load_robot("panda", f"@{where}"), load_robot("panda")
    for with_tool, without in (
        (load(arm, tip=f"@{where}"), bare),
        (load(arm, tip=f"{bare.tip}@{where}"), bare),
        (load(arm.replace(bare.tip, "tool"), tip=f"tool@{where}"), bare),
        of_catalog,
    ):
        q = with_tool.home
        model, data = with_tool.model, with_tool.model.createData()
        pin.framesForwardKinematics(model, data, q)
        found = data.oMf[with_tool.frame_id(with_tool.tip)]
        data = without.model.createData()
        pin.framesForwardKinematics(without.model, data, q)
        wanted = data.oMf[without.frame_id(without.tip)] * place
        assert found.isApprox(wanted, 1e-9), (with_tool.tip, without.tip)
        assert "a tool at" in texts(with_tool, "note")


@pytest.mark.parametrize("place", ["", "0,0", "0,0,x", "0,0,nan", "0,0,1e9", "0,0,0,0", "0,0,0,0,0,0,0"])
def test_a_wrong_place_of_a_tool_is_refused_in_one_sentence(place: str) -> None:
    with pytest.raises(InputError, match=r"^The place '.*' of a tool is not x,y,z or .*--tool 0,0,0.1\.$"):
        load(two_joint_arm(), tip=f"@{place}")


def test_continuous_becomes_unbounded_with_one_coordinate() -> None:
    text = two_joint_arm(j2=joint("j2", "l1", "l2", "continuous", '<limit velocity="3" effort="5"/>'))
    loaded = load(text)
    assert loaded.model.nq == loaded.model.nv == 2
    assert loaded.q_upper[1] == np.inf
    assert loaded.q_lower[1] == -np.inf
    assert "continuous" in texts(loaded, "note")


def test_missing_speed_and_effort_are_filled() -> None:
    loaded = load(two_joint_arm(j2=joint("j2", "l1", "l2", inside='<limit lower="-1" upper="1"/>')))
    assert loaded.v_limit[1] == pytest.approx(np.pi)
    assert loaded.tau_limit[1] > 3 * 9.81 * 0.1
    assert "velocity limit" in texts(loaded, "filled")
    assert "effort limit" in texts(loaded, "filled")


def test_missing_position_limits_mean_unbounded() -> None:
    loaded = load(two_joint_arm(j2=joint("j2", "l1", "l2", inside='<limit velocity="1" effort="1"/>')))
    assert loaded.q_upper[1] == np.inf
    assert "no position limits" in texts(loaded, "filled")


def test_limits_an_exporter_left_at_zero_mean_unbounded() -> None:
    inside = '<limit lower="0" upper="0" velocity="0" effort="0"/>'
    loaded = load(two_joint_arm(j2=joint("j2", "l1", "l2", inside=inside)))
    assert loaded.q_upper[1] == np.inf
    assert "exporters" in texts(loaded, "filled")


def test_one_sided_limits() -> None:
    inside = '<limit lower="0.5" upper="1e9" velocity="1" effort="1"/>'
    loaded = load(two_joint_arm(j2=joint("j2", "l1", "l2", inside=inside)))
    assert (loaded.q_lower[1], loaded.q_upper[1]) == (0.5, np.inf)
    assert loaded.home[1] > 0.5


def test_swapped_limits_and_long_axes_are_repaired() -> None:
    inside = '<limit lower="1" upper="-2" velocity="1" effort="1"/>'
    loaded = load(two_joint_arm(j2=joint("j2", "l1", "l2", inside=inside, axis="0 2 0")))
    assert (loaded.q_lower[1], loaded.q_upper[1]) == (-2, 1)
    assert "swapped" in texts(loaded, "repaired")
    assert "normalised" in texts(loaded, "repaired")


def test_mimic_and_finger_joints_are_fixed() -> None:
    finger = joint("left_finger_joint", "l2", "f1", "prismatic", axis="0 1 0")
    follower = joint(
        "follower",
        "l2",
        "f2",
        "prismatic",
        LIMIT + '<mimic joint="left_finger_joint" offset="0.02"/>',
        "0 1 0",
    )
    loaded = load(two_joint_arm(link("f1") + link("f2") + finger + follower))
    assert loaded.joint_names == ("j1", "j2")
    assert "mimics" in texts(loaded, "fixed")
    assert "left_finger_joint" in texts(loaded, "fixed")
    offset = loaded.model.frames[loaded.frame_id("f2")].placement.translation
    np.testing.assert_allclose(offset, [0.3, 0.02, 0.1], atol=1e-12)


def test_the_driver_of_a_mimic_gripper_is_fixed_but_a_parallel_arm_is_not() -> None:
    gripper = joint("drive", "l2", "f1") + joint("other", "l2", "f2", inside=LIMIT + '<mimic joint="drive"/>')
    assert load(two_joint_arm(link("f1") + link("f2") + gripper)).joint_names == ("j1", "j2")
    parallel = joint("j3", "l2", "l3", inside=LIMIT + '<mimic joint="j2" multiplier="-1"/>')
    assert load(two_joint_arm(link("l3") + parallel)).joint_names == ("j1", "j2")


def test_a_joint_without_room_is_fixed_where_it_stands() -> None:
    inside = '<limit lower="0.5" upper="0.5" velocity="1" effort="1"/>'
    loaded = load(two_joint_arm(link("l3") + joint("j3", "l2", "l3", inside=inside)))
    assert loaded.joint_names == ("j1", "j2")
    rotation = loaded.model.frames[loaded.frame_id("l3")].placement.rotation
    assert np.arccos(0.5 * (np.trace(rotation) - 1)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("inside", "kind", "words"),
    [
        ("", "filled", "no mass"),
        ('<inertial><mass value="2"/></inertial>', "filled", "solid sphere"),
        (inertial("2", "0 0 0"), "filled", "solid sphere"),
        (inertial("2", "0.1 0.1 0.5"), "repaired", "A + B < C"),
        (inertial("2", "-0.1 0.2 0.2"), "repaired", "negative moment"),
        (inertial("0", "0.1 0.1 0.1"), "repaired", "without mass"),
    ],
)
def test_unphysical_inertias_become_physical(inside: str, kind: Kind, words: str) -> None:
    loaded = load(two_joint_arm(l2=link("l2", inside)))
    assert words in texts(loaded, kind)
    for body in list(loaded.model.inertias)[1:]:
        moments = np.linalg.eigvalsh(body.inertia)
        assert body.mass > 0
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2]


def test_massless_links_fixed_to_heavy_ones_are_fine() -> None:
    loaded = load(two_joint_arm(link("tool0", "") + joint("t", "l2", "tool0", "fixed", "")))
    assert [finding.where for finding in loaded.report.findings] == ["rotors", "contacts", "floor"]
    assert loaded.tip == "tool0"


REFUSED = {
    "not XML": ("<robot><link", "well-formed"),
    "empty": ("", "well-formed"),
    "wrong root": ("<sdf/>", "<robot>"),
    "doctype": ('<!DOCTYPE r [<!ENTITY x "y">]><robot name="a">&x;</robot>', "DOCTYPE"),
    "xacro": (
        '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="b"/></robot>',
        "xacro",
    ),
    "xacro number": (two_joint_arm(l2=link("l2", inertial("${m}", "1 1 1"))), "xacro"),
    "no link": ("<robot name='a'/>", "no link"),
    "no joint": (robot(link("base")), "none of its joints"),
    "only fixed": (
        robot(link("base"), link("a"), joint("j", "base", "a", "fixed", "")),
        "none of its joints moves",
    ),
    "two roots": (two_joint_arm(link("loose")), "2 root links"),
    "loop": (robot(link("a"), link("b"), joint("x", "a", "b"), joint("y", "b", "a")), "loop"),
    "two parents": (two_joint_arm(joint("j3", "base", "l2")), "2 joints carry it"),
    "duplicate": (two_joint_arm(link("l2")), "2 times"),
    "unnamed": (two_joint_arm(link("")), "no name"),
    "unknown link": (two_joint_arm(j2=joint("j2", "l1", "l22")), "did you mean 'l2'"),
    "floating": (two_joint_arm(j2=joint("j2", "l1", "l2", "floating", "")), "several axes"),
    "planar": (two_joint_arm(j2=joint("j2", "l1", "l2", "planar", "")), "several axes"),
    "unknown type": (two_joint_arm(j2=joint("j2", "l1", "l2", "revolut")), "did you mean 'revolute'"),
    "zero axis": (two_joint_arm(j2=joint("j2", "l1", "l2", axis="0 0 0")), "no length"),
    "nan axis": (two_joint_arm(j2=joint("j2", "l1", "l2", axis="nan 0 1")), "finite"),
    "short origin": (two_joint_arm().replace("0.3 0 0.1", "0.3 0"), "3 finite numbers"),
    "word as limit": (
        two_joint_arm(j2=joint("j2", "l1", "l2", inside=LIMIT.replace('"2"', '"two"'))),
        "finite number",
    ),
    "negative mass": (two_joint_arm(l2=link("l2", inertial("-1", "1 1 1"))), "positive mass"),
    "infinite mass": (two_joint_arm(l2=link("l2", inertial("inf", "1 1 1"))), "finite"),
    "universe": (two_joint_arm().replace("base", "universe"), "reserved"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_used_is_refused_in_one_sentence(case: str) -> None:
    text, words = REFUSED[case]
    with pytest.raises(InputError) as caught:
        load(text)
    message = str(caught.value)
    assert words in message
    assert "\n" not in message
    report = import_robot(text.encode(), "my.urdf").report
    assert not report.usable
    assert words in " ".join(finding.text for finding in report.of_kind("refused"))
    json.dumps(report.as_dict())


def test_no_entity_is_expanded_and_no_file_is_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("12345")
    text = f'<!DOCTYPE r [<!ENTITY x SYSTEM "file://{secret}">]><robot name="a">{link("l", "&x;")}</robot>'
    report = import_robot(text.encode(), "evil.urdf").report
    assert not report.usable
    assert "12345" not in str(report.as_dict())


def test_check_urdf_reads_files(tmp_path: Path) -> None:
    good = tmp_path / "arm.urdf"
    good.write_text(two_joint_arm())
    report = check_urdf(good)
    assert report.usable
    assert report.joints == ("j1", "j2")
    with pytest.raises(InputError, match="Cannot read"):
        check_urdf(tmp_path / "none.urdf")
    assert check_urdf(tmp_path).joints == report.joints
    with pytest.raises(InputError, match="has no robot description"):
        check_urdf(Path(__file__).parents[1] / "commands")


def test_a_missing_mesh_is_a_note() -> None:
    visual = '<visual><geometry><mesh filename="package://nowhere/a.dae"/></geometry></visual>'
    loaded = load(two_joint_arm(l2=link("l2", INERTIAL + visual)))
    assert "nowhere" in texts(loaded, "note")
    assert "nowhere" not in loaded.urdf_text


BOX = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'


@pytest.mark.parametrize(
    ("shape", "why"),
    [
        ('<visual><geometry><sphere radius="big"/></geometry></visual>', "radius is 'big'"),
        ('<collision><geometry><box size="1 2"/></geometry></collision>', "size is '1 2'"),
        ("<visual><geometry><cone/></geometry></visual>", "one of box, cylinder, sphere, mesh"),
        ("<visual/>", "one of box"),
        ('<visual><geometry/><geometry><box size="1 1 1"/></geometry></visual>', "one of box"),
        ('<visual><origin xyz="0 0 nan"/><geometry><sphere radius="1"/></geometry></visual>', "xyz is"),
    ],
)
def test_a_shape_without_valid_numbers_is_left_out_with_a_note(shape: str, why: str) -> None:
    """The other shapes of the link stay."""
    loaded = load(two_joint_arm(l2=link("l2", INERTIAL + shape + BOX)))
    (note,) = (finding for finding in loaded.report.of_kind("note") if finding.where == "link 'l2'")
    assert "left out" in note.text and why in note.text
    assert [each.kind for each in described_shapes(loaded, "visuals")["l2"]] == ["box"]
    assert not described_shapes(loaded, "collisions")["l2"]


def test_a_shape_has_the_colour_of_the_material_that_it_names() -> None:
    named = BOX.replace("</visual>", '<material name="red"/></visual>')
    wrong = '<material name="blue"><color rgba="0 0 much 1"/></material>'
    text = two_joint_arm(l2=link("l2", INERTIAL + named + named.replace("red", "blue") + BOX))
    red = '<material name="red"><color rgba="1 0 0 1"/></material>'
    loaded = load(text.replace("</robot>", red + wrong + "</robot>"))
    colours = [each.colour for each in described_shapes(loaded, "visuals")["l2"]]
    assert colours[0] is not None and colours[0].tolist() == [1.0, 0.0, 0.0]
    assert colours[1:] == [None, None]


def test_canonical_text_is_a_fixed_point() -> None:
    first = load(two_joint_arm(j2=joint("j2", "l1", "l2", "continuous", "")))
    second = load(first.urdf_text)
    assert second.urdf_text == first.urdf_text
    assert not second.report.of_kind("repaired")
    np.testing.assert_array_equal(first.q_upper, second.q_upper)


EXAMPLES = {
    "ur_description/urdf/ur10_robot.urdf": (6, "ee_link"),
    "xarm_description/urdf/xarm7.urdf": (7, "link_eef"),
    "panda_description/urdf/panda.urdf": (7, "panda_hand_tcp"),
    "kinova_description/robots/kinova.urdf": (6, "j2s6s200_end_effector"),
    "so_arm_description/urdf/so101.urdf": (5, "gripper_frame_link"),
    "g1_description/urdf/g1_29dof_rev_1_0.urdf": (17, "left_rubber_hand"),
}


def test_a_hand_does_not_hang_in_the_floor_at_home() -> None:
    """The tip of this arm is high enough, but its hand reaches 0.15 m lower, as that of an SO-100 does."""
    stand = '<collision><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision>'
    hand = '<collision><origin xyz="0 0 -0.15"/><geometry><sphere radius="0.03"/></geometry></collision>'
    heights = []
    for shape in ("", hand):
        loaded = load(
            two_joint_arm(extra="", l2=link("l2", INERTIAL + shape)).replace(
                link("base"), link("base", stand)
            )
        )
        assert "its scene has no floor" not in texts(loaded, "note")
        data = loaded.model.createData()
        pin.framesForwardKinematics(loaded.model, data, loaded.home)
        heights.append(data.oMf[loaded.frame_id(loaded.tip)].translation[2])
    lowest_of_all = lowest(loaded)[1]
    assert lowest_of_all is not None and lowest_of_all > 0.03
    assert heights[1] > heights[0]


def test_a_wrist_that_carries_no_weight_gets_a_motor_like_its_carrier() -> None:
    """A joint that only turns the hand about the hand's own axis carries no weight, but its motor is not
    hundred times weaker than that of the joint before it."""
    free = '<limit lower="-2" upper="2" velocity="3"/>'
    hand = inertial("0.01", "1e-6 1e-6 1e-6")
    loaded = load(
        two_joint_arm(
            j2=joint("j2", "l1", "l2", inside=free),
            extra=link("hand", hand) + joint("turn", "l2", "hand", inside=free, axis="1 0 0"),
        )
    )
    limits = dict(zip(loaded.joint_names, loaded.tau_limit, strict=True))
    assert limits["j1"] == 50.0  # its own
    assert limits["turn"] == pytest.approx(0.2 * limits["j2"], rel=0.05)
    assert limits["j2"] >= 0.2 * limits["j1"]
    assert "2 N·m was estimated from the joint that carries it" in texts(loaded, "filled")


OFTEN = ("panda_description/urdf/panda.urdf", "so_arm_description/urdf/so101.urdf")
"""Robots that are loaded at every push: an arm with a hand, and a small one."""


@pytest.mark.parametrize(
    "file",
    [
        file if file in OFTEN else pytest.param(file, marks=pytest.mark.nightly("robots/", "tests/robots/"))
        for file in EXAMPLES
    ],
)
def test_robots_of_example_robot_data(file: str) -> None:
    paths = [share / file for share in installed_shares() if (share / file).is_file()]
    if not paths:
        pytest.skip("example-robot-data is not installed: pip install himpc-lab[meshes]")
    loaded = load_robot(paths[0])
    joints, tip = EXAMPLES[file]
    assert loaded.model.nq == loaded.model.nv == loaded.n == joints
    assert loaded.tip == tip
    assert np.all((loaded.home >= loaded.q_lower) & (loaded.home <= loaded.q_upper))
    assert np.all(loaded.tau_limit > 0)
    tip, data = loaded.frame_id(loaded.tip), loaded.model.createData()
    pin.framesForwardKinematics(loaded.model, data, loaded.home)
    room = data.oMf[tip].translation[2] / chain_length(loaded.model, tip)
    assert room > 0.1, "at home the tip has no room below it"
    assert "mesh file" not in texts(loaded, "note")
    if file == OFTEN[0]:
        assert load_robot(paths[0]).home.tobytes() == loaded.home.tobytes()
