"""Small files with what URDFs of other people contain: each loads with a finding, or one sentence says what
to change. Each file has one kind of fault."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from arms import humanoid, joint, link, load, robot, two_joint_arm

from robots import InputError, Robot, load_robot, load_urdf_text
from robots.urdf import canonicalise

FIELD = Path(__file__).parent / "field"
ARM = two_joint_arm()


def findings(text: str | bytes) -> str:
    """Returns all findings of a document that can be used."""
    data = text if isinstance(text, bytes) else text.encode()
    canonical, report = canonicalise(data, "mine.urdf")
    assert canonical is not None, report.findings
    return " | ".join(map(str, report.findings))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("default_namespace", "default namespace 'http://drake.mit.edu' was left out"),
        ("limits_1e16", "means that it is unbounded"),
        ("limits_in_degrees", "looks like degrees"),
        ("undeclared_prefix_in_gazebo", "no link and no joint is affected"),
        ("world_not_declared", "'world' is not described and was added"),
        ("xacro_property_left_over", "1 left-over element(s) of xacro"),
    ],
)
def test_files_of_other_people_load_with_a_finding(name: str, words: str) -> None:
    loaded = load_robot(FIELD / f"{name}.urdf")
    assert loaded.n == 3
    assert words in " | ".join(map(str, loaded.report.findings))
    # Home is inside ±π even if the limits are in degrees.
    assert np.abs(loaded.home).max() <= np.pi


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ("<robot", "\n <!-- made by hand -->\n<?xml version='1.0'?>\n<robot", ""),
        ("<link", "<!-- a -- b --><link", "Double hyphen"),
        ('"0.3 0 0.1"', '"0.3, 0 0.1"', "1 list(s) of numbers had commas"),
        ("</robot>", "<gazebo a='1' b=2><sensor:x/>a & b</gazebo></robot>", "not well-formed"),
        ("<robot", "\ufeff\n<?xml version='1.0'?>\n<robot", ""),
        ("</robot>", "</robot>\n\0", ""),
        ('name="base">', 'name="base"><visual name="a & b"/>', "1 ampersand(s)"),
    ],
    ids=["before the declaration", "hyphens", "commas", "gazebo", "mark", "zero byte", "ampersand"],
)
def test_xml_that_other_readers_accept(before: str, after: str, words: str) -> None:
    assert words in findings(ARM.replace(before, after, 1))


def test_an_attribute_with_an_undeclared_prefix_is_left_out() -> None:
    assert load(ARM.replace("<limit", '<limit drake:acceleration="15"')).n == 2


def test_latin_1_without_saying_so() -> None:
    assert "read as Latin-1" in findings(ARM.replace("<link", "<!-- Größe --><link", 1).encode("latin-1"))


@pytest.mark.parametrize("said", ["utf-8", "UTF8", "ascii"])
def test_another_encoding_than_the_declared_one(said: str) -> None:
    """Editors keep the declaration of a file that they save in another encoding."""
    named = f'<?xml version="1.0" encoding="{said}"?>\n' + ARM.replace('name="arm"', 'name="Größe"')
    canonical, report = canonicalise(named.encode("latin-1"), "mine.urdf")
    assert canonical is not None and canonical.name == "Größe"
    assert "read as Latin-1" in str([*map(str, report.findings)])
    canonical, _ = canonicalise(named.encode(), "mine.urdf")
    assert canonical is not None and canonical.name == "Größe"


@pytest.mark.parametrize("encoding", ["utf-16", "gb2312", "cp1252", "latin-1"])
def test_declared_encodings_are_read(encoding: str) -> None:
    name = "机器人" if encoding == "gb2312" else "Größe"
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n' + ARM.replace('name="arm"', f'name="{name}"')
    canonical, _ = canonicalise(text.encode(encoding), "mine.urdf")
    assert canonical is not None and canonical.name == name


def test_comments_cost_no_time() -> None:
    """An exporter writes a comment before each link; reading them once took longer than the limit of 10 s."""
    comments = "<!-- a link -->\n" * 20_000
    assert load_urdf_text(ARM.replace("<link", f"{comments}<link", 1)).n == 2


@pytest.mark.parametrize("old", ['axis xyz="', "</joint>", '<parent link="'])
def test_a_damaged_link_or_joint_stays_refused(old: str) -> None:
    """What is lost cannot be known, so nothing is guessed."""
    with pytest.raises(InputError, match="not well-formed XML"):
        load(ARM.replace(old, old[:-1], 1))
    with pytest.raises(InputError, match="not well-formed XML"):
        load(ARM[: ARM.rindex("</joint>")])


def test_a_template_is_told_from_left_over_elements() -> None:
    call = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'
    left = ARM.replace("<robot", call, 1).replace("</robot>", "<xacro:sensor name='s'/></robot>")
    assert "1 of them may have described links, sensors or colours" in findings(left)
    for template in (
        left.replace('name="l1"', 'name="${prefix}l1"'),
        left.replace('"l1"', '"$(arg prefix)l1"'),
        left.replace('upper="2"', 'upper="$(arg most)"'),
        left.replace(link("l2"), f'<xacro:if value="true">{link("l2")}</xacro:if>'),
        f'{call} name="a"><link name="l0"/><xacro:arm prefix="a"/></robot>',
    ):
        with pytest.raises(InputError, match=r"xacro template[;:] run `pip install xacro`"):
            load(template)


def test_a_robot_without_a_name_gets_one() -> None:
    name = ARM[ARM.index("<robot") : ARM.index(">", ARM.index("<robot")) + 1]
    assert "<robot> has no name" in findings(ARM.replace(name, "<robot>"))


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_floating_base_is_welded(kind: str) -> None:
    base = f'<joint name="free" type="{kind}"><parent link="ground"/><child link="base"/></joint>'
    text = ARM.replace("</robot>", f'<link name="ground"/>{base}</robot>')
    assert f"a {kind} joint carries the base" in findings(text)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_floating_base_behind_a_fixed_link_is_welded(kind: str) -> None:
    ground = joint("stand", "world", "ground", "fixed", "")
    base = f'<joint name="free" type="{kind}"><parent link="ground"/><child link="base"/></joint>'
    text = ARM.replace("</robot>", f'{base}<link name="ground"/>{ground}</robot>')
    assert f"a {kind} joint carries the base" in findings(text)
    with pytest.raises(InputError, match="make it fixed"):
        load(ARM.replace('name="j2" type="revolute"', f'name="j2" type="{kind}"'))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('<sdf version="1.6"><model name="m"/></sdf>', "root element is <sdf>.*give a URDF.*<mujoco>"),
        ("<!DOCTYPE html><html><body>404</body></html>", "root element is <html>"),
    ],
)
def test_a_document_that_is_no_robot_is_told_what_can_be_given(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load(text)


def test_a_document_with_a_prefixed_root_is_read() -> None:
    text = ARM.replace("<robot", '<r:robot xmlns:r="http://x.y"').replace("</robot>", "</r:robot>")
    assert load(text).n == 2


def test_unlimited_speed_and_effort_are_filled() -> None:
    for unlimited in ("inf", "1e16", "3.402823466e+38", "1.7976931348623157e308"):
        text = ARM.replace('velocity="3"', f'velocity="{unlimited}"').replace(
            'effort="50"', f'effort="{unlimited}"'
        )
        assert text != ARM
        told = findings(text)
        assert "no velocity limit" in told
        assert "no effort limit" in told


@pytest.mark.parametrize(("kind", "unit"), [("revolute", "kg·m²"), ("prismatic", "(sliding joints: kg)")])
def test_the_report_says_from_what_the_rotors_were_assumed(kind: str, unit: str) -> None:
    told = str(load(two_joint_arm(j2=joint("j2", "l1", "l2", kind))).report.of_kind("filled"))
    assert f"{unit} were assumed from what they move and from their torque and speed limits" in told


def test_an_effort_that_hardly_holds_the_arm_is_reported_and_kept() -> None:
    """Real arms hold less than their whole range; home is a posture that the motors hold easily."""
    strong, weak = load(ARM), load(ARM.replace('effort="50"', 'effort="4"'))
    assert "its effort limit is 4 N·m; holding the robot takes up to" in str(weak.report.findings)
    assert "estimated" not in str(weak.report.of_kind("repaired"))
    np.testing.assert_array_equal(weak.tau_limit, 4.0)
    loads = [
        np.abs(pin.computeGeneralizedGravity(arm.model, arm.model.createData(), arm.home)).max()
        for arm in (strong, weak)
    ]
    assert loads[0] > 4.0 and loads[1] < 0.8 * 4.0, loads


def test_efforts_that_contradict_the_masses_are_estimated() -> None:
    """Limits with which the arm cannot hold itself in most postures are placeholders. The others are kept."""
    text = ARM.replace('effort="50"', 'effort="1"', 1)
    contrary = load(text)
    told = " | ".join(map(str, contrary.report.of_kind("repaired")))
    assert "'j1': its effort limit is 1 N·m; holding the robot takes up to" in told
    assert contrary.tau_limit[0] > 15.0 and contrary.tau_limit[1] == 50.0
    again = load(contrary.urdf_text)
    np.testing.assert_array_equal(again.tau_limit, contrary.tau_limit)
    on_purpose = load(text.replace("<robot ", '<robot underactuated="true" '))
    np.testing.assert_array_equal(on_purpose.tau_limit, (1.0, 50.0))


def test_the_home_of_a_planar_arm_is_bent() -> None:
    """A planar arm has fewer independent motions than joints: its Jacobian has no largest least singular
    value, and it stood stretched."""
    arm = load(
        robot(
            *map(link, ("base", "l1", "l2", "l3", "l4")),
            *(joint(f"j{k}", f"l{k - 1}" if k > 1 else "base", f"l{k}") for k in range(1, 5)),
        )
    )
    assert np.abs(arm.home[1:]).max() > 0.3, arm.home


def test_the_home_of_an_arm_with_three_joints_is_not_stretched() -> None:
    """It stood upright: its joints turn the hand independently there, but the first one does not move it."""
    arm = load_robot(FIELD / "world_not_declared.urdf")
    J = pin.computeFrameJacobian(
        arm.model, arm.model.createData(), arm.home, arm.frame_id(arm.tip), pin.LOCAL_WORLD_ALIGNED
    )
    assert np.linalg.svd(J[:3])[1][1] > 0.1, arm.home  # m: the tip moves in two directions


def test_masses_that_are_put_there_are_not_heavier_than_the_motors_carry() -> None:
    """Shapes are often drawn thicker than the robot; the effort limits of the file are known."""
    thick = '<collision><geometry><cylinder radius="0.2" length="0.6"/></geometry></collision>'
    text = two_joint_arm(j2=joint("j2", "l1", "l2"), l2=link("l2", thick)).replace(
        link("l1"), link("l1", thick)
    )
    arm = load(text)
    assert "masses that were put there are multiplied by" in " | ".join(map(str, arm.report.findings))
    assert "holding the robot takes" not in " | ".join(map(str, arm.report.findings))
    assert 0.1 < arm.model.inertias[1].mass < 30.0
    weak = load(text.replace('effort="50"', 'effort="0"'))
    assert weak.model.inertias[1].mass == pytest.approx(1000.0 * np.pi * 0.04 * 0.6)


def test_position_limits_that_nobody_filled_in() -> None:
    """If most joints have lower = upper = 0, they are unbounded. A single one is held."""
    every = ARM.replace('lower="-2" upper="2"', 'lower="0" upper="0"')
    assert np.isinf(load(every).q_upper).all()
    assert "1e+06" not in findings(every)
    one = ARM.replace('lower="-2" upper="2"', 'lower="0" upper="0"', 1)
    assert load(one).n == 1


def test_a_joint_that_cannot_follow_another_is_held_and_the_report_says_what_is_wrong() -> None:
    """A follower with a range that leaves its leader none, or with a strange factor, is held."""
    text = (FIELD / "mimic_in_chain.urdf").read_text()
    assert "'j3': it follows 'j2': -1 · q + 0" in str([*map(str, load_urdf_text(text).report.findings)])
    narrow = text.replace('multiplier="-1" offset="0"', 'multiplier="-1" offset="100"')
    arm = load_urdf_text(narrow)
    assert arm.joint_names == ("j1", "j2") and arm.model.njoints == 3
    told = str(arm.report.of_kind("fixed"))
    assert "it should follow 'j2' with factor -1, which is not simulated (its own range leaves its" in told
    assert "leader none): what it carries moves differently on the real robot" in told
    strange = text.replace('multiplier="-1"', 'multiplier="1e-9"')
    assert "(its factor or its offset is out of range)" in findings_of(strange)
    unknown = text.replace('mimic joint="j2"', 'mimic joint="nobody"')
    assert "it mimics 'nobody', which does not exist" in findings_of(unknown)
    both = load_robot(FIELD / "mimic_in_chain.urdf", hold=("j2=0.5",))
    assert "not simulated" not in str(both.report.findings)
    np.testing.assert_allclose(
        both.model.frames[both.frame_id("link3")].placement.rotation, np.eye(3), atol=1e-12
    )


def test_an_inertia_in_another_unit_is_reported() -> None:
    """1 kg with 200 kg m2 would be 14 m away from its centre; the arm is 0.3 m long."""
    text = ARM.replace('ixx="0.01" iyy="0.02" izz="0.02"', 'ixx="100" iyy="200" izz="200"', 1)
    told = [str(each) for each in load_urdf_text(ARM.replace("0.01", "0.011")).report.findings]
    assert "check its unit" not in str(told)
    text = text[::-1].replace('"20.0"=zzi "20.0"=yyi "10.0"=xxi', '"002"=zzi "002"=yyi "001"=xxi', 1)[::-1]
    assert "as if its mass were 14 m from its centre, and the arm is" in findings_of(text)


def findings_of(text: str) -> str:
    """Returns all findings of a robot that can be used."""
    return " | ".join(map(str, load_urdf_text(text).report.findings))


def turned(arm: Robot, frame: str) -> float:
    """Returns the angle about y, rad, by which the file's joints have turned a frame that is held."""
    R = arm.model.frames[arm.frame_id(frame)].placement.rotation
    return float(np.arctan2(R[0, 2], R[2, 2]))


MIMIC = '<limit lower="-2" upper="2"/><mimic joint="{}" multiplier="{}" offset="{}"/>'


def test_followers_of_a_held_joint_are_where_it_puts_them() -> None:
    """The limits move the driver of the gripper to 0.4 rad; a follower of a follower follows, too."""
    inside = '<limit lower="0.4" upper="1" velocity="1" effort="1"/>'
    gripper = (
        joint("last", "f1", "f2", inside=MIMIC.format("other", 2, 0.1))
        + joint("other", "l2", "f1", inside=MIMIC.format("drive", -0.5, 0.05))
        + joint("drive", "l2", "f3", inside=inside)
    )
    hand = two_joint_arm("".join(map(link, ("f1", "f2", "f3"))) + gripper)
    arm = load_urdf_text(hand)
    assert arm.joint_names == ("j1", "j2")
    assert turned(arm, "f3") == pytest.approx(0.4)
    assert turned(arm, "f1") == pytest.approx(-0.15)
    assert turned(arm, "f2") == pytest.approx(-0.15 - 0.2)
    assert "joint 'other': held at -0.15 rad: it mimics 'drive', which is held at 0.4" in str(
        [*map(str, arm.report.findings)]
    )
    assert turned(load_urdf_text(hand, hold=("drive=1",)), "f2") == pytest.approx(-0.45 - 0.8)


def test_followers_are_placed_after_the_joints_that_do_not_move_the_tip_are_held() -> None:
    """The fingers of a large hand are held because too many joints move: their followers are where they
    belong, and no finding says that they should move."""
    text = (FIELD / "arm_and_hand_21_joints.urdf").read_text()
    follower = joint("knob", "h42", "knob", inside=MIMIC.format("f42", 3, 0))
    assert 'name="f42"' in text
    held = text.replace("</robot>", link("knob") + follower + "</robot>")
    arm = load_urdf_text(held)
    assert arm.n == 6
    assert "not simulated" not in str(arm.report.findings)
    assert "'knob'" in str(arm.report.of_kind("fixed"))


def test_a_joint_that_carries_an_arm_moves_although_a_rod_follows_it() -> None:
    """A palletising robot: a rod beside the upper arm keeps the hand level. It carries nothing, and the
    joint that it follows is no gripper."""
    for name, told, names in (
        ("rod", "joint 'rod': it follows 'j2': 1 · q + 0", ("j1", "j2", "j3")),
        # Pinocchio sorts joints beside one another by their names, and the first of them leads.
        ("bar", "joint 'j2': it follows 'bar': 1 · q + 0", ("j1", "bar", "j3")),
    ):
        rod = joint(name, "l1", "bar", inside=MIMIC.format("j2", 1, 0))
        arm = load_urdf_text(
            two_joint_arm(link("l3") + joint("j3", "l2", "l3", axis="1 0 0") + link("bar") + rod)
        )
        assert arm.joint_names == names
        assert told in " | ".join(map(str, arm.report.findings))


@pytest.mark.parametrize("names", [("left_finger_joint", "right_finger_joint"), ("j3", "j4")])
def test_a_finger_is_no_tip_whatever_its_link_is_called(names: tuple[str, str]) -> None:
    """The joints say what they carry, by their names or as one follows the other."""
    one, other = names
    slide = '<limit lower="0" upper="0.04" velocity="1" effort="9"/>'
    hand = (
        link("l3")
        + link("l4")
        + joint(one, "l2", "l3", "prismatic", slide)
        + joint(other, "l2", "l4", "prismatic", f'{slide}<mimic joint="{one}"/>')
    )
    arm = load(two_joint_arm(hand))
    assert (arm.tip, arm.report.tips, arm.n) == ("l2", (), 2)
    assert "gripper=" not in arm.urdf_text


# ------------------------------------------------------------------ joints that are held


def test_the_shin_of_a_leg_without_a_foot_is_no_tip() -> None:
    """A humanoid that is welded at its torso: its legs have more joints than its arms. The pelvis has as many
    as an arm, but carries a leg."""
    names = {
        "arm": ("shoulder", "upper_arm", "lower_arm"),
        "leg": ("waist_1", "waist_2", "pelvis", "thigh", "shin"),
    }
    parts = [
        link(name) + joint(f"j_{name}", before, name)
        for limb in names.values()
        for before, name in pairwise(("torso", *limb))
    ]
    assert load(robot(link("torso"), *parts)).tip == "lower_arm"


def test_joints_that_do_not_move_the_tip_are_held_where_too_many_move() -> None:
    """An arm with a hand of 15 joints moves with its palm; one finding is about the hand."""
    arm = load_robot(FIELD / "arm_and_hand_21_joints.urdf")
    assert arm.joint_names == tuple(f"j{k}" for k in range(1, 7))
    assert arm.tip == "link6"
    (held,) = arm.report.of_kind("fixed")
    assert str(held) == (
        "fixed: link 'link6': 15 joints that it carries (f00 … f42) do not move the tip 'link6': held at 0; "
        "--hold or --tip chooses others"
    )
    finger = load_robot(FIELD / "arm_and_hand_21_joints.urdf", "h42")
    assert finger.joint_names == (*arm.joint_names, "f40", "f41", "f42")


def test_a_humanoid_of_29_joints_stands_on_its_pelvis_and_works_with_one_arm_or_two() -> None:
    both = load_urdf_text(humanoid())
    assert both.n == 17
    assert not any("hip" in name or "ankle" in name for name in both.joint_names)
    told = str(both.report.of_kind("fixed"))
    assert "12 joints that it carries (left_hip_pitch_joint … right_ankle_roll_joint)" in told
    one = load_urdf_text(humanoid(), "left_hand", hold=("right_(should|elb|wri).*", "waist_roll_joint=0.2"))
    assert (one.n, one.tip) == (9, "left_hand")
    assert "joint 'waist_roll_joint': held at 0.2 rad: 'waist_roll_joint=0.2' holds it" in str(
        [*map(str, one.report.findings)]
    )
    frame = one.model.frames[one.frame_id("waist_roll_link")].placement
    np.testing.assert_allclose(frame.rotation[2, 2], np.cos(0.2), atol=1e-12)


def test_patterns_hold_joints_of_every_robot_and_count_before_the_limit() -> None:
    assert load_urdf_text(ARM, hold=("j2",)).joint_names == ("j1",)
    arm = load_robot("panda", hold=("joint[35]", "joint7=9"))
    assert arm.joint_names == ("joint1", "joint2", "joint4", "joint6")
    assert arm.tip == load_robot("panda").tip
    assert "held at 2.897 rad" in str(arm.report.of_kind("fixed"))  # the end of its range
    gripper = joint("drive", "l2", "f1") + joint(
        "other", "l2", "f2", inside='<limit lower="-2" upper="2"/><mimic joint="drive" multiplier="-0.5"/>'
    )
    text = ARM.replace("</robot>", link("f1") + link("f2") + gripper + "</robot>")
    open_ = load_urdf_text(text, hold=("drive=0.6",))
    turned = [open_.model.frames[open_.frame_id(name)].placement.rotation[0, 2] for name in ("f1", "f2")]
    np.testing.assert_allclose(turned, np.sin([0.6, -0.3]), atol=1e-12)  # the other finger follows


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("j(", "is not a regular expression"),
        ("j9", "j1, j2"),
        ("j", r"describes a whole name, such as '\.\*j\.\*'"),
        ("j1=nan", "nan"),
        ("j[12]", "none of its joints moves"),
    ],
)
def test_a_wrong_pattern_is_one_sentence(pattern: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_urdf_text(ARM, hold=(pattern,))
