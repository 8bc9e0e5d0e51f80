"""Changes of settings while the robot moves: numbers are written into the tick, and a change of structure
builds a new one. Both give the same torques."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from control_loop import iiwa_settings

from himpc import HIMPC, Settings
from himpc.controllers import make_controller
from himpc.kinematics.configuration import Configuration
from himpc.limits.limits import Avoidance
from himpc.references import Hold, Outlook
from himpc.references.outlook import Observed
from robots import InputError, NominalSettings, Robot
from robots.collision import Ball

Change = Callable[[Settings], Settings]


def of_level(**numbers: Any) -> Change:
    return lambda s: replace(s, stack=(replace(s.stack[0], **numbers), *s.stack[1:]))


def of_task(**numbers: Any) -> Change:
    return lambda s: of_level(tasks=(replace(s.stack[0].tasks[0], **numbers),))(s)


def of_limits(**numbers: float) -> Change:
    return lambda s: replace(s, limits=replace(s.limits, **numbers))


def of_avoidance(**numbers: float) -> Change:
    return lambda s: replace(s, limits=replace(s.limits, avoidance=replace(s.limits.avoidance, **numbers)))


NUMBERS: dict[str, Change] = {
    "Q": of_level(Q=300.0),
    "Q of each row": of_level(Q=(300.0, 20.0, 40.0)),
    "R": of_level(R=2.0),
    "R of each joint": of_level(R=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)),
    "K_p": of_task(K_p=150.0),
    "K_v": of_task(K_v=(30.0, 10.0, 20.0)),
    "M̄": lambda s: replace(s, M_bar=tuple(1.3 * number for number in s.M_bar)),
    "torque limits": of_limits(torque_scale=0.05),
    "velocity limits": of_limits(velocity_scale=0.15),
    "approach": of_limits(velocity_approach=40.0),
    "torque rate": of_limits(torque_rate=1000.0),
    "d_safe": of_avoidance(d_safe=0.03),
    "margin": of_avoidance(margin=0.04),
    "reaction": of_avoidance(reaction=0.4),
    "deceleration": of_avoidance(deceleration=0.5),
    "pull": of_avoidance(pull=0.02),
    "free velocity": of_avoidance(velocity_margin=0.3),
    "many": lambda s: of_avoidance(pull=0.2)(
        of_limits(torque_scale=0.5)(of_task(K_p=90.0)(of_level(R=5.0)(s)))
    ),
}
STRUCTURE: dict[str, Change] = {
    "N": lambda s: replace(s, horizon=7),
    "T_s": lambda s: replace(s, T_s=0.002),
    "on and off": of_level(enabled=False),
    "own horizon": of_level(horizon=2),
    "order": lambda s: replace(s, stack=s.stack[::-1]),
    "no torque rate": of_limits(torque_rate=0.0),
    "no distances": of_avoidance(on=False),
    "no stiffness": of_task(K_p=0.0),
}


def tight(robot: Robot, **changes: Any) -> Settings:
    """Returns settings with all kinds of rows, some of which are active."""
    settings = iiwa_settings(robot, **changes)
    limits = replace(settings.limits, torque_scale=0.1, velocity_scale=0.2, torque_rate=2000.0)
    return replace(settings, limits=replace(limits, avoidance=Avoidance(on=True, d_safe=0.02)))


def torques(controller: Any, first: int, ticks: int) -> np.ndarray:
    """Returns the torques of some ticks on a motion through the home posture, with a ball near the tip."""
    robot, taus = controller.robot, []
    tip = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n)).placement()
    values = {"position": tip.translation, "orientation": tip.rotation, "q1": robot.home[:1]}
    references = {name: Hold(np.array(value)) for name, value in values.items()}
    x, y, z = tip.translation.tolist()
    ball = Observed((Ball("ball", (x + 0.2, y, z), 0.1),))
    for k in range(first, first + ticks):
        phase = 0.002 * k + np.arange(robot.n)
        q, v = robot.home + 0.1 * np.sin(phase), 0.2 * np.cos(phase)
        taus.append(controller.step(q, v, Outlook(references, 1e-3 * k, 1e-3, 5, ball)).tau)
    return np.array(taus)


def rebuilt(settings: Settings) -> Settings:
    """Returns settings of another structure with the same torques: these controllers use no nominal model."""
    return replace(settings, nominal=NominalSettings(payload_kg=1.0))


@pytest.mark.parametrize("kind", NUMBERS)
@pytest.mark.parametrize("name", ["himpc", "hiqp", "nhimpc", "weighted", "himpc_filtered", "himpc_printed"])
def test_a_number_that_is_written_has_the_torques_of_a_rebuilt_controller(
    iiwa: Robot, name: str, kind: str
) -> None:
    """Every tick after the change has bitwise the torque of a controller that is built anew and continues
    from the memory of the old one, also while a level fades in."""
    settings = tight(iiwa)
    faint = of_level(enabled=False)(settings)
    one, other = (make_controller(name, iiwa, faint) for _ in range(2))
    ticks = 4 if name == "himpc_printed" else 30
    for each in (one, other):
        torques(each, 0, ticks)
        each.configure(settings)
    before = torques(one, ticks, ticks)
    np.testing.assert_array_equal(before, torques(other, ticks, ticks))
    assert isinstance(one, HIMPC) and isinstance(other, HIMPC)
    kept, left = one.kernel, other.kernel
    changed = NUMBERS[kind](settings)
    one.configure(changed)
    other.configure(rebuilt(changed))
    assert one.kernel is kept, "the number is written"
    assert other.kernel is not left, "the other controller is built anew"
    after = torques(one, 2 * ticks, 2 * ticks)
    np.testing.assert_array_equal(after, torques(other, 2 * ticks, 2 * ticks))


@pytest.mark.parametrize("kind", STRUCTURE)
def test_another_structure_is_built_anew(iiwa: Robot, kind: str) -> None:
    """Zero counts as a structure: it switches some settings off."""
    settings = tight(iiwa)
    controller = HIMPC(iiwa, settings)
    kernel = controller.kernel
    controller.configure(STRUCTURE[kind](settings))
    assert controller.kernel is not kernel


def test_each_number_changes_the_torque(iiwa: Robot) -> None:
    """Otherwise equal torques would show nothing."""
    settings = tight(iiwa)
    plain = torques(HIMPC(iiwa, settings), 0, 60)
    for kind, change in NUMBERS.items():
        assert np.abs(torques(HIMPC(iiwa, change(settings)), 0, 60) - plain).max() > 1e-6, kind


def test_a_refused_number_changes_nothing(iiwa: Robot) -> None:
    settings = of_level(enabled=False)(tight(iiwa))
    one, other = HIMPC(iiwa, settings), HIMPC(iiwa, settings)
    for each in (one, other):
        torques(each, 0, 20)
    wrong = [
        of_level(Q=(1.0, 2.0)),
        of_level(R=(1.0, 2.0)),
        of_task(K_p=(1.0, 2.0)),
        lambda s: replace(of_limits(torque_scale=0.1)(s), M_bar=s.M_bar[:-1]),
    ]
    for change in wrong:
        with pytest.raises(InputError):
            one.configure(change(settings))
    assert one.settings == settings
    np.testing.assert_array_equal(torques(one, 20, 40), torques(other, 20, 40))


@pytest.mark.parametrize("name", ["himpc", "weighted"])
def test_a_reset_ends_a_fade(iiwa: Robot, name: str) -> None:
    """A controller that is reset while a level fades in has the torques of a new controller."""
    settings = tight(iiwa)
    one, other = (
        make_controller(name, iiwa, of_level(enabled=False)(settings)),
        make_controller(name, iiwa, settings),
    )
    torques(one, 0, 20)
    one.configure(settings)
    torques(one, 20, 20)
    one.reset(np.zeros(iiwa.n))
    np.testing.assert_array_equal(torques(one, 0, 40), torques(other, 0, 40))
