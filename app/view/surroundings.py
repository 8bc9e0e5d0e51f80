"""The surroundings of a mobile robot: people with balls, and the circle of its arm's reach."""

from __future__ import annotations

import numpy as np
import viser

from app.html.palette import BOUND, JOINTS, RGB
from app.link.mission_view import Person

_BALL: RGB = (245, 190, 30)
_BALL_RADIUS = 0.06  # m
_POINTS = 96
_TALL, _WIDE, _HEAD = 1.25, 0.17, 0.12  # m, of a person


class People:
    """Figures of people with an extended hand, and the balls that they have received."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shown: list[tuple[Person, viser.SceneNodeHandle]] = []

    def show(self, people: tuple[Person, ...]) -> None:
        if people == tuple(person for person, _ in self._shown):
            return
        before = self._shown
        self._shown = []
        for index, person in enumerate(people):
            if index < len(before) and before[index][0] == person:
                self._shown.append(before[index])
                continue
            if index < len(before):
                before[index][1].remove()
            self._shown.append((person, self._draw(index, person)))

    def _draw(self, index: int, person: Person) -> viser.SceneNodeHandle:
        scene, node, colour = self._scene, f"/person/{index}", JOINTS[(index + 3) % len(JOINTS)]
        place = np.array([*person.place, 0.0])
        figure = scene.add_frame(node, show_axes=False, position=place)
        scene.add_cylinder(
            f"{node}/body", _WIDE, _TALL, color=colour, position=(0, 0, 0.5 * _TALL), cast_shadow=False
        )
        scene.add_icosphere(
            f"{node}/head",
            radius=_HEAD,
            color=(225, 190, 165),
            position=(0, 0, _TALL + 0.8 * _HEAD),
            cast_shadow=False,
        )
        shoulder, hand = np.array([0.0, 0.0, 0.85 * _TALL]), np.array(person.hand) - place
        arm = np.array([[shoulder, hand - [0.0, 0.0, _BALL_RADIUS]]], np.float32)
        scene.add_line_segments(f"{node}/arm", arm, colour, thickness=0.06)
        for k in range(person.balls):
            # A pile of balls on the floor in front of the person.
            away = 0.35 * hand[:2] / max(float(np.linalg.norm(hand[:2])), 1e-6)
            beside = 0.13 * (k - 0.5 * (person.balls - 1)) * np.array([-away[1], away[0]]) / 0.35
            scene.add_icosphere(
                f"{node}/got{k}",
                radius=_BALL_RADIUS,
                color=_BALL,
                position=(*(away + beside), _BALL_RADIUS),
                cast_shadow=False,
            )
        return figure


class Carried:
    """The ball in the robot's hand."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._ball = scene.add_icosphere(
            "/carried", radius=_BALL_RADIUS, color=_BALL, visible=False, cast_shadow=False
        )

    def follow(self, tip: np.ndarray, carried: bool) -> None:
        """tip (3,): the position of the hand, m."""
        if self._ball.visible != carried:
            self._ball.visible = carried
        if carried and not np.allclose(tip, self._ball.position, rtol=0.0, atol=1e-4):
            self._ball.position = tip


class ReachCircle:
    """The arm's reach as a circle on the floor around the base. If a goal of the hand is outside the circle,
    the base must move."""

    def __init__(self, scene: viser.SceneApi, joint: int, radius: float) -> None:
        """joint: number, 1 … n, of the base's last joint; the circle moves with the frame of this joint;
        radius: m."""
        angles = np.linspace(0.0, 2 * np.pi, _POINTS + 1)
        circle = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros_like(angles)], axis=1)
        segments = np.stack([circle[:-1], circle[1:]], axis=1).astype(np.float32)
        self._circle = scene.add_line_segments(
            f"/robot/{joint}/reach", segments, BOUND, thickness=0.012, position=(0.0, 0.0, 0.006)
        )

    def show(self, on: bool) -> None:
        if self._circle.visible != on:
            self._circle.visible = on
