"""3D recordings of the lessons that need no server: viser's own player, and one recorded scene per lesson.

All scenes use the same player file. A scene is a JavaScript file in the same folder, because a page that is
opened from a disk may load scripts, but no other files.
"""

from __future__ import annotations

import base64
import contextlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from app.html.palette import GHOST, level_colours
from app.view.camera import fit
from app.view.robot import RobotView, camera_for
from app.worker.simulation import LinkPoses
from lessons.teaching.lesson import Lesson
from robots import Robot

Array = NDArray[np.float64]

_BALL = 0.03
"""The radius of the ball that marks a target, m."""
_LOOK_UP = """<script>
(() => {
  const asked = location.hash.slice(1).split(",");
  if (!/^[a-z0-9-]+$/.test(asked[0])) return;
  window.__VISER_EMBED_CONFIG__ = { darkMode: asked[1] === "dark" };
  document.write('<script src="' + asked[0] + '.js"><' + '/script>');
})();
</script>"""


def player() -> str:
    """Returns the HTML of viser's client, which loads the scene that its address names: `player.html#NAME` or
    `#NAME,dark`."""
    client = Path(viser.__file__).parent / "client" / "build" / "index.html"
    text = client.read_text(encoding="utf-8")
    head = text.index("</head>")
    return text[:head] + _LOOK_UP + text[head:]


def film(lesson: Lesson, motion: Mapping[str, Any]) -> str:
    """Returns the script of a lesson's scene."""
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a panel at its start
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        return (
            f'window.__VISER_EMBED_DATA__="{base64.b64encode(_filmed(server, lesson, motion)).decode()}";\n'
        )
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _filmed(server: viser.ViserServer, lesson: Lesson, motion: Mapping[str, Any]) -> bytes:
    scene = lesson.run_of(lesson.steps[motion["step"]]).prepared()
    robot, q = scene.robot, [np.array(each, float) for each in motion["q"]]
    poses = [_poses(robot, way) for way in q]
    targets = {name: _in_space(np.array(way, float)) for name, way in motion["targets"].items()}
    colours = level_colours([level.name for level in scene.settings.levels])
    server.scene.set_up_direction("+z")
    server.scene.add_grid("/floor", width=6.0, height=6.0, cell_size=0.5, position=(0.0, 0.0, -0.002))
    robots = [RobotView(server.scene, robot)]
    robots += [RobotView(server.scene, robot, "/ghost", GHOST, 0.35) for _ in poses[1:]]
    size = max(1.0, 0.25 * float(np.ptp(np.concatenate(poses)[:, :, :3].reshape(-1, 3), axis=0).max()))
    balls = {
        name: server.scene.add_icosphere(
            f"/target/{name}", radius=_BALL * size, color=colours.get(name, GHOST), opacity=0.8
        )
        for name in targets
    }
    points = np.concatenate([way[:, :, :3].reshape(-1, 3) for way in poses] + [*targets.values()])
    points = points[np.isfinite(points).all(axis=1)]
    seen_from, seen_at, _ = camera_for(robot)
    eye, at = fit(np.vstack([points, np.zeros(3)]), seen_from - seen_at, 0.87, 1.0)
    server.initial_camera.position, server.initial_camera.look_at = tuple(eye), tuple(at)
    server.initial_camera.fov = 0.87
    kept = server.get_scene_serializer()
    for k in range(max(len(way) for way in poses)):
        for view, way in zip(robots, poses, strict=True):
            view.move(way[min(k, len(way) - 1)])
        for name, way in targets.items():
            if np.isfinite(way[k]).all() and (k == 0 or not np.allclose(way[k], way[k - 1], atol=1e-4)):
                balls[name].position = way[k]
        kept.insert_sleep(motion["period"])
    return kept.serialize()


def _poses(robot: Robot, q: Array) -> Array:
    """Returns the poses of the links (k, n, 7) along a path q (k, n) of the joints. After control was lost,
    the last valid pose is repeated."""
    links, found = LinkPoses(robot), []
    for each in q:
        at = links.at(each)
        found.append(found[-1] if at is None else at[: robot.n].copy())
    return np.array(found)


def _in_space(way: Array) -> Array:
    """Returns points (k, 3) from points of two or three coordinates; with two coordinates, z = 0."""
    return way if way.shape[1] == 3 else np.column_stack([way, np.zeros(len(way))])


def motion_of(path: Path) -> Mapping[str, Any]:
    """Returns the recorded motion of a lesson's robot from a file that `docs.record` wrote."""
    told: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return told["motion"]
