"""Mutated URDFs and random bytes raise no exception but InputError, and every repaired inertia is
physical."""

from __future__ import annotations

from io import StringIO

import numpy as np
from arms import INERTIAL, LIMIT, joint, link, load, two_joint_arm
from hypothesis import given, settings
from hypothesis import strategies as st
from yourdfpy import URDF

from robots import InputError, Plant
from robots.loading.importing import import_robot
from robots.urdf import canonicalise
from robots.urdf.inertials import nearest_physical


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_the_nearest_physical_inertia_is_physical(values: list[float]) -> None:
    xx, yy, zz, xy, xz, yz = values
    given_inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    physical, violation = nearest_physical(given_inertia)
    moments = np.linalg.eigvalsh(physical)
    assert moments[0] >= 0
    assert moments[0] + moments[1] >= moments[2] * (1 - 1e-9)
    again, none = nearest_physical(physical)
    assert none <= 1e-9
    np.testing.assert_allclose(again, physical, atol=1e-6 * max(1e-9, moments[2]))
    if violation == 0.0:
        np.testing.assert_allclose(physical, given_inertia, atol=1e-8)


WORDS = [
    "",
    "0",
    "-1",
    "1e308",
    "1e-300",
    "1e8",
    "5",
    "nan",
    "inf",
    "1 0 0",
    "0 0 0",
    "a",
    "l1",
    "base",
    "é",
    "revolute",
    "fixed",
    "floating",
]


@settings(max_examples=250, deadline=None)
@given(st.data())
def test_no_mutation_of_a_urdf_raises_anything_but_an_input_error(data: st.DataObject) -> None:
    gripper = joint("drive", "l2", "f1") + joint("other", "l2", "f2", inside=LIMIT + '<mimic joint="drive"/>')
    text = two_joint_arm(link("f1") + link("f2") + gripper)
    pieces = text.split('"')
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(pieces) - 1))
        pieces[place] = data.draw(st.sampled_from([*WORDS, pieces[place][: len(pieces[place]) // 2], ""]))
    mutated = '"'.join(pieces)
    report = import_robot(mutated.encode(), "mutated.urdf").report
    try:
        loaded = load(mutated)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert report.usable
        assert loaded.model.nq == loaded.model.nv
        assert np.all(np.isfinite(loaded.home))
        assert np.all(loaded.M_bar > 0)
        plant = Plant(loaded)
        plant.step(plant.holding_torque(), 1e-3)


TAGS = ("box", "sphere", "cylinder", "mesh", "cone", "geometry", "visual", "collision", "origin", "color")
SHAPES = (
    '<visual><origin xyz="0 0 1" rpy="0 1 0"/><geometry><box size="1 1 1"/></geometry>'
    '<material name="m"><color rgba="1 0 0 1"/></material></visual>'
    '<visual><geometry><cylinder radius="1" length="2"/></geometry><material name="m"/></visual>'
    '<collision><geometry><sphere radius="1"/></geometry></collision>'
)


@settings(max_examples=500, deadline=None)
@given(st.data())
def test_yourdfpy_reads_the_shapes_of_every_accepted_description(data: st.DataObject) -> None:
    """Whatever the attributes and elements of a shape are, the import leaves only shapes that can be read."""
    pieces = two_joint_arm(link("f1") + joint("drive", "l2", "f1"), l2=link("l2", INERTIAL + SHAPES)).split(
        '"'
    )
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(pieces) - 1))
        old, new = data.draw(st.sampled_from(TAGS)), data.draw(st.sampled_from(TAGS))
        changed = pieces[place].replace(f"<{old}", f"<{new}").replace(f"</{old}", f"</{new}")
        pieces[place] = data.draw(st.sampled_from([*WORDS, "1,2", "1 2 3 4", changed, changed]))
    canonical, _ = canonicalise('"'.join(pieces).encode(), "mutated.urdf")
    if canonical is not None:
        URDF.load(StringIO(canonical.text), build_scene_graph=False, load_meshes=False)


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_raise_from_the_check(junk: bytes) -> None:
    assert not import_robot(junk, "junk").report.usable
