"""Pictures of a tick as SVG: they are well-formed, inside their frame, and agree with the numbers."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from lxml import etree

from app.html.palette import LEVELS
from app.link.messages import Inside, InsideRequest
from app.panels.inside import matrix as hessian
from app.panels.inside.inside import InsideSubscription
from app.panels.inside.matrix import spectrum_markup
from app.panels.inside.plane import half_width, parts
from lessons.events import MoveTarget
from lessons.geometry.look import matrix_of, plane_of
from lessons.geometry.plane import Plane
from lessons.scenes.catalog import prepared, torque_scene
from lessons.session.torque import TorqueSession

JOINTS = ("one & two", "<three>")
"""Joint names from an untrusted file."""


@pytest.fixture(scope="module")
def session() -> TorqueSession:
    running = TorqueSession(prepared(torque_scene("planar3-plane"), None, ("limits.torque_scale=0.01",)))
    running.post(MoveTarget("reach", (0.33,)))
    for _ in range(150):
        running.advance()
    return running


@pytest.fixture(scope="module")
def plane(session: TorqueSession) -> Plane:
    return plane_of(session, (0, 1), "")


def parsed(markup: str) -> etree._Element:
    return etree.fromstring(f"<svg>{markup}</svg>".encode())


def drawn(plane: Plane, half: float) -> etree._Element:
    return parsed("".join(parts(plane, half, {"reach": LEVELS[0], "pose": LEVELS[1]}, JOINTS)))


def test_points_stand_where_their_numbers_say(plane: Plane) -> None:
    half = half_width(plane, None)
    root = drawn(plane, half)
    for name, w in (("optimum-1", plane.levels[0].solved), ("optimum-2", plane.levels[1].solved)):
        (mark,) = root.findall(f".//g[@class='{name}']")
        assert np.allclose([float(each) for each in mark.get("data-at", "").split(",")], w, atol=1e-9)
        x, y = (float(each) for each in re.findall(r"-?[\d.]+", mark.get("transform", ""))[:2])
        scale = 180.0 / half
        assert (x, y) == pytest.approx((50.0 + scale * (w[0] + half), 10.0 + scale * (half - w[1])), abs=0.06)
    words = " ".join(str(text) for text in root.itertext())
    assert "N·m" in words and "<three>" in words and "torque" in words


def test_what_is_far_off_is_an_arrow_with_its_numbers(plane: Plane) -> None:
    far = replace(plane, osf=np.array([50.0, -20.0]))
    half = half_width(plane, None)
    assert half_width(far, None) == half  # a distant OSF solution does not change the scale
    (mark,) = drawn(far, half).findall(".//g[@class='osf']")
    x, y = (float(each) for each in re.findall(r"-?[\d.]+", mark.get("transform", ""))[:2])
    assert 50.0 < x < 410.0 and 10.0 < y < 370.0
    assert "(50, −20)" in "".join(str(text) for text in mark.itertext())


def test_the_picture_holds_still_while_points_breathe(plane: Plane) -> None:
    half = half_width(plane, None)
    assert half_width(plane, 1.5 * half) == 1.5 * half
    assert half_width(plane, 10.0 * half) == half
    assert half_width(plane, 0.1 * half) == half


def test_nothing_that_is_not_finite_is_drawn(plane: Plane) -> None:
    box = replace(plane.box, lower=np.array([-np.inf, -1.0]), upper=np.array([np.inf, np.inf]))
    root = drawn(replace(plane, box=box, osf=np.array([np.nan, 0.0]), weighted=None), 1.0)
    text = etree.tostring(root).decode()
    assert "nan" not in text and "inf" not in text and not root.findall(".//g[@class='osf']")


def test_the_hessian_marks_what_holds_the_solution(session: TorqueSession) -> None:
    found = matrix_of(session, "pose")
    assert found.shade.shape == (3, 3) and found.condition > 1.0
    assert [(each.joint, each.kind) for each in found.active] == [(0, "torque")]
    root = parsed(hessian.markup(found, ("a", "b", "<c>")))
    assert len(root.findall(".//g[@class='active']")) == 1
    many = TorqueSession(prepared(torque_scene("iiwa14-hold"), None, ("horizon=20",)))
    many.advance()
    large = matrix_of(many, "nobody's level")
    assert large.level == "position" and large.shown == 9 and large.shade.shape == (63, 63)
    markup = hessian.markup(large, many.robot.joint_names)
    assert len(markup) < 60_000
    parsed(markup)


def test_eigenvalues_stand_on_the_real_axis() -> None:
    root = parsed(spectrum_markup([0.98, 0.2, -1.3, -50.0]))
    marks = root.findall(".//circle[@class='eigenvalue']")
    x = [float(mark.get("cx", "")) for mark in marks]
    assert x == sorted(x, reverse=True) and x[0] - 180.0 == pytest.approx(0.98 * 78.0, abs=0.1)
    assert min(x) >= 0.0 and {mark.get("cy") for mark in marks} == {"92.0"}
    assert "grows" in "".join(str(text) for text in root.itertext())
    parsed(spectrum_markup([math.nan, math.inf]))


def test_a_wish_is_sent_once_and_again_if_nothing_comes_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("app.panels.inside.inside.time.monotonic", lambda: now[0])
    sent: list[InsideRequest] = []
    watching = InsideSubscription(sent.append)
    watching.ask(InsideRequest(), None)
    assert not sent  # the panel is not visible, so nothing is requested
    wish = InsideRequest(plane=(0, 1))
    for _ in range(3):
        watching.ask(wish, None)
    assert sent == [wish]
    now[0] += 1.0
    watching.ask(wish, Inside())
    assert sent == [wish]
    watching.ask(wish, None)  # the run was restarted
    assert sent == [wish, wish]
    watching.ask(InsideRequest(), Inside())
    assert sent[-1] == InsideRequest()
