"""MuJoCo models are imported as MuJoCo's own compiler reads them."""

from __future__ import annotations

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest
from arms import full_mass_matrix

from robots import InputError, Robot, load_robot, load_urdf_text
from robots.loading.importing import import_robot
from robots.shapes.link_shapes import link_shapes

ARM = """<mujoco model="my arm">
  <compiler angle="degree" autolimits="true"/>
  <default>
    <joint armature="0.1" damping="1"/>
    <default class="wrist"><joint armature="0.02"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base"><geom type="cylinder" size="0.05 0.05" pos="0 0 0.05"/>
      <body name="upper" pos="0 0 0.1" quat="0.7071 0 0.7071 0">
        <inertial pos="0.1 0 0.02" mass="2" fullinertia="0.02 0.03 0.04 0.001 0.002 0.003"/>
        <joint name="shoulder" axis="1 0 0" range="-170 170" actuatorfrcrange="-60 60"/>
        <joint name="lift" axis="0 1 0.5" pos="0 0.03 0.05" range="-90 120" ref="20"/>
        <body name="rail" pos="0.3 0 0" euler="10 20 30">
          <joint name="slide" type="slide" axis="0 0 1" range="-0.1 0.2" armature="3"/>
          <geom name="beam" type="box" size="0.02 0.03 0.15" mass="0.7"/>
          <body name="hand" pos="0 0.02 0.2" axisangle="1 1 0 40">
            <joint class="wrist" name="turn" pos="0.01 0.02 0.03"/>
            <geom type="capsule" fromto="0 0 0 0.1 0 0.1" size="0.02" density="800"/>
            <geom type="ellipsoid" size="0.02 0.03 0.04" pos="0.1 0 0"/>
            <site name="attachment_site" pos="0.1 0 0.1" quat="0.5 0.5 0.5 0.5"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="a" joint="shoulder" kp="100" forcerange="-87 87"/>
    <motor name="b" joint="lift" gear="50" ctrlrange="-1 1"/>
    <general name="c" joint="slide" forcerange="-10 20" gear="2"/>
  </actuator>
</mujoco>"""


def loaded(text: str, folder: Path | None = None) -> Robot:
    return import_robot(text.encode(), "arm.xml", folder).used()


def same_mechanics(robot: Robot, model: mujoco.MjModel, close: float = 1e-9) -> None:
    """Compares M(q), gravity and the frames of all bodies with MuJoCo's, at random q."""
    import pinocchio as pin

    data, own = mujoco.MjData(model), robot.model.createData()
    joints = [model.joint(name) for name in robot.joint_names]
    order = [int(joint.dofadr[0]) for joint in joints]
    M = np.zeros((model.nv, model.nv))
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = rng.uniform(np.maximum(robot.q_lower, -2.0), np.minimum(robot.q_upper, 2.0))
        for joint, value in zip(joints, q, strict=True):
            data.qpos[joint.qposadr[0]] = value
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M)
        np.testing.assert_allclose(full_mass_matrix(robot.model, q), M[np.ix_(order, order)], atol=close)
        gravity = pin.computeGeneralizedGravity(robot.model, own, q)
        np.testing.assert_allclose(gravity, data.qfrc_bias[order], atol=close)
        pin.framesForwardKinematics(robot.model, own, q)
        for body in range(1, model.nbody):
            frame = own.oMf[robot.frame_id(model.body(body).name)]
            np.testing.assert_allclose(frame.translation, data.xpos[body], atol=1e-9)
            np.testing.assert_allclose(frame.rotation, data.xmat[body].reshape(3, 3), atol=1e-9)


def test_an_arm_has_the_mechanics_of_mujoco() -> None:
    """Anchors, references, turned frames, inertias from shapes, a slide, several joints of a body: a link of
    1 mg stands between these."""
    robot = loaded(ARM)
    model = mujoco.MjModel.from_xml_string(ARM)
    same_mechanics(robot, model, close=1e-5)
    one_each = ARM.replace('<joint name="lift"', '<body name="lifted"><geom size="0.1"/><joint name="lift"')
    one_each = one_each.replace("  </worldbody>", "</body></worldbody>")
    same_mechanics(loaded(one_each), mujoco.MjModel.from_xml_string(one_each))
    same_mechanics(loaded_again(loaded(one_each)), mujoco.MjModel.from_xml_string(one_each))
    limits = {name: (robot.q_lower[k], robot.q_upper[k]) for k, name in enumerate(robot.joint_names)}
    for name, (lower, upper) in limits.items():
        np.testing.assert_allclose(
            (lower, upper), model.joint(name).range if name != "turn" else (-np.inf, np.inf)
        )
    effort = dict(zip(robot.joint_names, robot.tau_limit, strict=True))
    assert (effort["shoulder"], effort["lift"], effort["slide"]) == (60.0, 50.0, 40.0)
    assert robot.name == "my arm"
    assert "attachment_site" in robot.frames
    told = str(robot.report.findings)
    assert "4 joints with friction, damping or a spring" in told
    assert "were assumed" not in told, "the rotors are given"
    assert "joint 'turn'" in told, "without limits"


def test_motors_that_are_too_weak_are_estimated_unless_joints_have_none_on_purpose() -> None:
    """Nothing moves the joint 'turn', as in an acrobot: the other motors keep their limits."""
    weak = ARM.replace('gear="50"', 'gear="1"')
    moved = weak.replace("</actuator>", '<motor joint="turn" ctrlrange="-9 9"/></actuator>')
    for text, kept in ((weak, True), (moved, False)):
        robot = loaded(text)
        lift = float(robot.tau_limit[robot.joint_names.index("lift")])
        assert (lift == 1.0) is kept, lift
        assert (loaded_again(robot).tau_limit == robot.tau_limit).all()


def test_a_thing_with_joints_that_no_motor_moves_stands_beside_the_robot() -> None:
    """A door of a kitchen, or the goal of an exercise, is no part of the robot and no tip."""
    door = '<body name="door" pos="9 0 0"><joint name="hinge" axis="0 0 1"/><geom size="0.1"/></body>'
    kitchen = ARM.replace('<body name="base">', f'{door}<body name="base">')
    robot = loaded(kitchen)
    assert robot.n == 4 and "door" not in robot.frames
    assert "1 parts of things that stand beside the robot" in str(robot.report.findings)
    motors = kitchen[kitchen.index("<actuator>") : kitchen.index("</actuator>") + len("</actuator>")]
    assert loaded(kitchen.replace(motors, "")).n == 5, "without motors it is not known which is the robot"


def loaded_again(robot: Robot) -> Robot:
    return import_robot(robot.urdf_text.encode(), "the text").used()


def test_what_a_chain_of_links_cannot_be_is_left_out_or_refused() -> None:
    more = ARM.replace(
        '<body name="base">',
        '<body name="cup" pos="1 0 0"><freejoint/><geom size="0.1"/></body><body name="base"><freejoint/>',
    ).replace(
        "</mujoco>",
        '<tendon><fixed name="t"><joint joint="turn" coef="1"/></fixed></tendon>'
        '<equality><weld body1="hand" body2="cup"/></equality>'
        '<sensor><jointpos joint="turn"/></sensor></mujoco>',
    )
    robot = loaded(more)
    told = str(robot.report.findings)
    for words in ("1 parts of things", "1 tendons", "1 equality", "its free joint was made fixed"):
        assert words in told
    assert robot.n == 4 and "cup" not in robot.frames
    same = loaded(ARM)
    np.testing.assert_allclose(
        full_mass_matrix(robot.model, robot.home), full_mass_matrix(same.model, robot.home), atol=1e-12
    )
    for text, words in (
        (
            ARM.replace('type="slide" axis="0 0 1" range="-0.1 0.2"', 'type="ball"'),
            "a ball joint has three axes",
        ),
        (ARM.replace("</body>", "", 1), "not well-formed XML"),
        (ARM.replace('joint="lift"', 'joint="lfit"'), "MuJoCo cannot compile it"),
        (
            ARM.replace("<worldbody>", '<include file="/etc/passwd"/><worldbody>'),
            "included file '/etc/passwd'",
        ),
        ("<mujoco/>", "none of its joints moves"),
        (ARM.replace("<worldbody>", '<asset><model name="m" file="a.xml"/></asset><worldbody>'), "attaches"),
    ):
        if "ball" in text:
            text = text.replace('<general name="c" joint="slide" forcerange="-10 20" gear="2"/>', "")
        with pytest.raises(InputError, match=words):
            loaded(text)


def test_a_finger_that_follows_another_is_a_mimic_joint() -> None:
    fingers = "".join(
        f'<body name="{side}"><joint name="{side}" type="slide" range="0 0.04"/><geom size="0.01"/></body>'
        for side in ("left", "right")
    )
    text = ARM.replace('<site name="att', f'{fingers}<site name="att').replace(
        "</mujoco>",
        '<equality><joint joint1="left" joint2="right" polycoef="0.01 1 0 0 0"/></equality></mujoco>',
    )
    robot = loaded(text)
    assert "mimics 'right'" in str(robot.report.findings)
    assert "equality" not in str(robot.report.findings)


def test_a_file_without_gravity_is_reported() -> None:
    """Its motors need not carry the arm (pusher of gymnasium); here they must."""
    assert "note: gravity" not in " | ".join(map(str, loaded(ARM).report.findings))
    text = ARM.replace("<default>", '<option gravity="0 0 0"/><default>', 1)
    assert "here it acts unless plant.gravity=false" in str(loaded(text).report.findings)


def with_keys(*keys: str, text: str = ARM) -> str:
    every = "".join(f"<key {key}/>" for key in keys)
    return text.replace("</mujoco>", f"<keyframe>{every}</keyframe></mujoco>")


START = (0.4, -0.3, 0.1, 0.7)


@pytest.mark.parametrize(
    "keys",
    [
        ('name="rest" qpos="0 0 0 0"', 'name="home" qpos="0.4 -0.3 0.1 0.7" ctrl="1 2"'),
        ('name="stand" qpos="0.4 -0.3 0.1 0.7"',),
        ('qpos="0.4 -0.3 0.1 0.7"',),
    ],
    ids=["named home", "the only one", "without a name"],
)
def test_a_robot_starts_from_the_home_of_its_file(keys: tuple[str, ...]) -> None:
    robot = loaded(with_keys(*keys))
    np.testing.assert_array_equal(robot.home, START)
    assert "note: home: the robot starts from the posture of its file" in [*map(str, robot.report.findings)]


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        (('qpos="0.4 -0.3 0.3 0.7"',), "joint 'slide' would be at 0.3, outside its range [-0.1, 0.2]"),
        (('name="home" qpos="0.4 -0.3 0.1"',), "its key posture 'home' has not 4 finite numbers"),
        (('name="home" qpos="0.4 -0.3 nan 0"',), "its key posture 'home' has not 4 finite numbers"),
        (('qpos="0 0 0 0"', 'qpos="1 1 0 0"'), "none of its 2 key postures is called 'home'"),
    ],
)
def test_a_home_that_cannot_be_used_is_reported(keys: tuple[str, ...], why: str) -> None:
    robot = loaded(with_keys(*keys))
    np.testing.assert_array_equal(robot.home, loaded(ARM).home)
    assert why in str([*map(str, robot.report.findings)])


def test_held_joints_stand_at_the_home_of_the_file() -> None:
    """The fingers of a gripper are open if they are open there."""
    fingers = "".join(
        f'<body name="{side}"><joint name="{side}_finger" type="slide" range="0 0.04"/><geom size="0.01"/>'
        "</body>"
        for side in ("left", "right")
    )
    text = ARM.replace('<site name="att', f'{fingers}<site name="att').replace(
        "</mujoco>",
        '<equality><joint joint1="left_finger" joint2="right_finger"/></equality></mujoco>',
    )
    robot = loaded(with_keys('name="home" qpos="0.4 -0.3 0.1 0.7 0.03 0.03"', text=text))
    np.testing.assert_array_equal(robot.home, START)
    for side in ("left", "right"):
        at = robot.model.frames[robot.frame_id(side)].placement.translation
        hand = robot.model.frames[robot.frame_id("hand")].placement
        assert hand.actInv(at)[2] == pytest.approx(0.03)


def brick(path: Path) -> None:
    """Writes a mesh without symmetry that is away from the origin."""
    corners = np.array([(0.1, 0, 0), (0.3, 0, 0), (0.1, 0.2, 0), (0.1, 0, 0.4)])
    faces = [corners[list(face)] for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]
    packed = b"".join(struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0) for face in faces)
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + packed)


MESHES = ARM.replace(
    "<worldbody>",
    '<asset><mesh name="brick" file="brick.stl" scale="1 0.5 -0.25"/><mesh name="gone" file="gone.stl"/>'
    '<texture name="t" type="2d" file="t.png"/><material name="red" texture="t" rgba="1 0 0 1"/></asset>'
    "<worldbody>",
).replace(
    '<geom name="beam"',
    '<geom type="mesh" mesh="brick" pos="0.1 0.2 0.3" euler="30 40 50" material="red" contype="0" '
    'conaffinity="0"/>'
    '<geom type="mesh" mesh="gone"/><geom name="beam"',
)


@pytest.mark.parametrize("meshdir", ["", "parts"])
def test_meshes_are_where_mujoco_draws_them(tmp_path: Path, meshdir: str) -> None:
    """The compiler centres and turns meshes. A mesh that is missing is left out."""
    text = MESHES.replace("<compiler", f'<compiler meshdir="{meshdir}"')
    (tmp_path / meshdir).mkdir(exist_ok=True)
    brick(tmp_path / meshdir / "brick.stl")
    whole = text.replace('<mesh name="gone" file="gone.stl"/>', "").replace(
        '<geom type="mesh" mesh="gone"/>', ""
    )
    whole = whole.replace('texture="t"', "").replace('<texture name="t" type="2d" file="t.png"/>', "")
    (tmp_path / "whole.xml").write_text(whole)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "whole.xml"))
    (tmp_path / "arm.xml").write_text(text)
    robot = load_robot(tmp_path / "arm.xml")
    assert "1 mesh file(s) not found ('gone.stl')" in str(robot.report.findings)
    same_mechanics(robot, model, close=1e-5)
    data = mujoco.MjData(model)
    for joint, value in zip(robot.joint_names, robot.home, strict=True):
        data.qpos[model.joint(joint).qposadr[0]] = value
    mujoco.mj_forward(model, data)
    geom = int(np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)[0])
    expected = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    (shape,) = (shape for shape in link_shapes(robot) if shape.name == "rail/0" and shape.colour[1] == 0)
    import pinocchio as pin

    own = robot.model.createData()
    pin.forwardKinematics(robot.model, own, robot.home)
    at = own.oMi[shape.joint]
    drawn = shape.vertices @ at.rotation.T + at.translation
    for corner in expected:
        assert np.linalg.norm(drawn - corner, axis=1).min() < 1e-6


def test_included_files_are_read_beside_the_model_only(tmp_path: Path) -> None:
    begin, end = ARM.index("  <worldbody>"), ARM.index("  <actuator>")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "body.xml").write_text(f"<mujoco>{ARM[begin:end]}</mujoco>")
    text = ARM[:begin] + '<include file="parts/body.xml"/>' + ARM[end:]
    (tmp_path / "arm.xml").write_text(text)
    assert load_robot(tmp_path / "arm.xml").n == 4
    assert load_robot(tmp_path / "arm.xml", within=tmp_path).n == 4
    with pytest.raises(InputError, match=r"included file 'parts/body\.xml'"):
        load_urdf_text(text)
    with pytest.raises(InputError, match=r"included file 'parts/body\.xml'"):
        import_robot(text.encode(), "arm.xml", tmp_path, within=tmp_path / "elsewhere").used()
    (tmp_path / "arm.xml").write_text(text.replace("parts/body.xml", "arm.xml"))
    with pytest.raises(InputError, match="a file includes itself"):
        load_robot(tmp_path / "arm.xml")


@pytest.mark.parametrize("file", ["/dev/zero", "/etc/passwd", "../../../etc/passwd"])
def test_a_model_of_a_stranger_opens_no_file(file: str) -> None:
    text = MESHES.replace("brick.stl", file).replace("t.png", file)
    assert "2 mesh file(s) not found" in str(load_urdf_text(text).report.findings)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('mass="2"', 'mass="nan"'),
        ('mass="2"', 'mass="1e300"'),
        ('pos="0 0 0.1"', 'pos="nan inf 1e200"'),
        ('axis="1 0 0"', 'axis="0 0 0"'),
        ('range="-170 170"', 'range="nan -1"'),
        ('armature="3"', 'armature="1e30"'),
        ('armature="3"', 'armature="-3"'),
        ('gear="50"', 'gear="nan"'),
        ('name="attachment_site"', """name="tool'&quot;]" """),
        ('name="rail"', 'name="upper after shoulder"'),
        ('name="rail"', f'name="{"n" * 50_000}"'),
        ("<worldbody>", "<worldbody>" + "<body>" * 5_000),
        ("<worldbody>", '<extension><plugin plugin="evil"/></extension><worldbody>'),
        ("<worldbody>", '<size memory="100G"/><worldbody>'),
        ("<mujoco", '<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco'),
        ("<compiler", '<compiler strippath="maybe" meshdir="/etc"'),
    ],
)
def test_a_hostile_model_runs_or_is_refused_in_one_sentence(old: str, new: str) -> None:
    assert old in ARM
    try:
        robot = loaded(ARM.replace(old, new, 1))
    except InputError as error:
        assert len(str(error)) < 400
        assert str(error).isprintable()
    else:
        for values in (robot.home, robot.M_bar, robot.tau_limit, robot.model.armature):
            assert np.isfinite(values).all()


def test_ranges_in_radians_without_a_word_of_it() -> None:
    """Models that a program completes leave the compiler's options to it."""
    text = ARM.replace('angle="degree" ', "").replace("-170 170", "-3 3").replace("-90 120", "-1.5 2.1")
    part = text.replace(' ref="20"', "").replace('euler="10 20 30"', 'euler="0.2 0.3 0.5"')
    robot = loaded(part)
    assert robot.q_upper[:2] == pytest.approx([3.0, 2.1])
    assert [each.where for each in robot.report.of_kind("repaired")] == ["arm.xml"]
    radians = part.replace("<compiler", '<compiler angle="radian"')
    same_mechanics(robot, mujoco.MjModel.from_xml_string(radians))
    told = loaded(part.replace("<compiler", '<compiler angle="degree"'))
    assert told.q_upper[:2] == pytest.approx(np.radians([3.0, 2.1]))
    assert not told.report.of_kind("repaired")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        ("<mujoco", "<!-- Größe --><mujoco", "read as Latin-1"),
        ("<mujoco", "\n<?xml version='1.0'?>\n<mujoco", ""),
        ("<default>", "<!-- a -- b --><default>", "nothing is lost"),
        ('name="upper"', 'name="a & b"', "1 ampersand(s)"),
    ],
    ids=["latin-1", "before the declaration", "hyphens", "ampersand"],
)
def test_xml_that_mujoco_accepts(before: str, after: str, told: str) -> None:
    text = ARM.replace(before, after, 1)
    assert text != ARM
    arm = import_robot(text.encode("latin-1"), "arm.xml").used()
    assert arm.n == loaded(ARM).n
    assert told in " | ".join(map(str, arm.report.findings))
    with pytest.raises(InputError, match="not well-formed"):
        loaded(ARM.replace("</body>", "", 1))


def test_a_model_that_grows_without_end_is_refused() -> None:
    many = '<replicate count="100000" offset="0 0 1"><body><joint/><geom size="0.1"/></body></replicate>'
    with pytest.raises(InputError):
        load_urdf_text(ARM.replace("<worldbody>", f"<worldbody>{many}"))
