"""The controls of a live figure as HTML inputs. Each input names the setting that it changes. The page adds
the list of levels and applies the changes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape
from typing import Any

from robots import Robot

_AXES = ("x", "y", "z")
_STEPS = 200
"""Number of positions of a slider."""


def controls(scene: dict[str, Any], robot: Robot, reach: float, horizons: Iterable[int], wide: bool) -> str:
    """Returns the controls of a scene.

    Args:
        scene: the data of the scene, see `docs.figures.scene`.
        robot: the robot whose links can be pushed.
        reach: the reach of the robot, m, see `docs.figures.robot.mechanics`.
        horizons: the values of N that can be chosen.
        wide: whether the most used groups of controls are open at first.
    """
    strict, plant, limits = scene["controller"] != "weighted", scene["plant"], scene["limits"]
    known = sorted({scene["horizon"], *horizons})
    dragged = [task for task in scene["tasks"] if task["frame"] and task["target"] == "position"]
    targets = [
        _boxed(
            f"Target of {task['name']}",
            *(
                _slider(axis, "m", (-reach, reach), 0.0, task=task["name"], axis=axis)
                for axis in task["axes"]
            ),
        )
        for task in dragged
    ]
    return "".join(
        (
            _group(
                "Levels, highest priority first",
                True,
                '<ol class="hl-levels"></ol>',
                ""
                if strict
                else _small("This controller weighs all levels: no level can be switched off or moved."),
            ),
            _group("Target", wide, *targets) if targets else "",
            _group(
                "Controller",
                wide,
                '<label class="hl-check">N '
                + _choice("N", {str(N): str(N) for N in known}, str(scene["horizon"]), path="horizon")
                + "</label>",
                _small("himpc-lab has more values of N" if len(known) > 1 else "this figure has one N only"),
                _scale("M_bar_scale", "M̄ scale", (0.1, 8.0), scene["M_bar_scale"]),
            ),
            _group(
                "Weights and gains",
                False,
                *(_weights(scene, level, strict) for level in range(len(scene["levels"]))),
            ),
            _group(
                "Limits",
                False,
                *(
                    _checkbox(f"limits.{name}", name, limits[name])
                    + _scale(f"limits.{name}_scale", "scale", (0.05, 2.0), limits[f"{name}_scale"])
                    for name in ("torque", "velocity")
                ),
            ),
            _group(
                "Robot",
                wide,
                _slider("Payload", "kg", (0.0, 10.0), plant["payload_kg"], path="plant.payload_kg"),
                _slider("Friction", "N·m", (0.0, 10.0), plant["friction"], path="plant.friction"),
                _checkbox("plant.gravity", "gravity", plant["gravity"]),
                _push(robot),
            ),
        )
    )


def _weights(scene: dict[str, Any], place: int, strict: bool) -> str:
    """Returns the controls of Q and R of a level, and of the gains of its tasks."""
    level, path = scene["levels"][place], f"levels.{scene['levels'][place]['name']}"
    found = [_slider("Q", "", (1.0, 2000.0), level["Q"], log=True, path=f"{path}.Q")]
    if strict:
        found.append(_slider("R", "", (0.1, 1000.0), level["R"], log=True, path=f"{path}.R"))
    for task in scene["tasks"]:
        if task["unit"] and task["level"] == place:
            path = f"tasks.{task['name']}"
            found.append(_slider("K_P", "1/s²", (0.0, 400.0), task["K_p"], path=f"{path}.K_p"))
            found.append(_slider("K_V", "1/s", (0.0, 60.0), task["K_v"], path=f"{path}.K_v"))
    return _boxed(level["name"], *found)


def _push(robot: Robot) -> str:
    links = {str(k): f"link {k} ({name})" for k, name in enumerate(robot.joint_names, 1)}
    return _boxed(
        "Push for 0.1 s",
        "at " + _choice("Pushed link", links, str(robot.n)),
        " along " + _choice("Direction of the push", {axis: axis for axis in _AXES}, "x"),
        _slider("Force", "N", (-200.0, 200.0), 60.0),
        '<button type="button" title="Push">Push</button>',
        name="push",
    )


def _group(title: str, shown: bool, *children: str) -> str:
    return f"<details{' open' * shown}><summary>{escape(title)}</summary>{''.join(children)}</details>"


def _boxed(title: str, *children: str, name: str = "") -> str:
    return f'<fieldset name="{name}"><legend>{escape(title)}</legend>{"".join(children)}</fieldset>'


def _small(words: str) -> str:
    return f'<p class="hl-small">{escape(words)}</p>'


def _told(**given: str) -> str:
    """Returns attributes that name what a control changes: `path` of a setting, or `task` and `axis` of a
    target."""
    return "".join(f' data-{name}="{escape(value)}"' for name, value in given.items())


def _checkbox(path: str, words: str, on: bool) -> str:
    box = f'<input type="checkbox"{" checked" * on}{_told(path=path)}>'
    return f'<label class="hl-check">{box}{escape(words)}</label>'


def _choice(label: str, options: dict[str, str], value: str, **given: str) -> str:
    told = (
        f'<option value="{escape(key)}"{" selected" * (key == value)}>{escape(words)}</option>'
        for key, words in options.items()
    )
    return f'<select aria-label="{escape(label)}"{_told(**given)}>{"".join(told)}</select>'


def _scale(path: str, words: str, ends: tuple[float, float], value: float) -> str:
    return _slider(words, "×", ends, value, log=True, path=path)


def _slider(
    words: str, unit: str, ends: tuple[float, float], value: Any, *, log: bool = False, **given: str
) -> str:
    """Returns a slider. With `log`, its position is the logarithm of the value. If there are
    several values, the slider shows the first one."""
    first = float(value[0] if isinstance(value, list | tuple) else value)
    low, high, at = ((math.log10(max(each, 1e-9)) if log else each) for each in (*ends, first))
    told = f"{float(f'{first:.3g}'):g} {unit}".strip()
    if log:
        given["log"] = "10"
    return (
        f'<label class="hl-slider"><span>{escape(words)}</span><input type="range" min="{low!r}" '
        f'max="{high!r}" step="{(high - low) / _STEPS!r}" value="{at!r}" aria-valuetext="{escape(told)}"'
        f"{_told(unit=unit, **given)}><output>{escape(told)}</output></label>"
    )
