"""Settings as assignments "PATH=VALUE": reads them, writes them, and finds the difference of two settings."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from lessons.settings.settings import SceneSettings
from robots import InputError

S = TypeVar("S", bound=SceneSettings)


def parse_assignment(text: str) -> tuple[str, Any]:
    """Returns ("horizon", 10) for "horizon=10". Values are JSON (numbers, true, lists) or plain words.

    Raises:
        InputError: there is no "=", or the value is NaN or infinite.
    """
    path, equals, value = text.partition("=")
    if not equals or not path:
        raise InputError(f"--set {text}: write it as PATH=VALUE, e.g. --set horizon=10")
    try:
        return path, json.loads(value, parse_constant=_refuse_constant(text))
    except RecursionError:
        raise InputError(f"--set {path}: the list is nested too deeply; give a number or a list") from None
    except InputError:
        raise
    except ValueError:
        if value.lower() in ("nan", "inf", "-inf", "infinity", ""):
            raise InputError(
                f"--set {text}: '{value}' is not a finite number; give one, e.g. {path}=1"
            ) from None
        return path, value


def _refuse_constant(text: str) -> Callable[[str], Any]:
    def refuse(constant: str) -> Any:
        raise InputError(f"--set {text}: {constant} is not a finite number; give one")

    return refuse


def with_assignments(settings: S, assignments: Iterable[str]) -> S:
    """Returns the settings after every "PATH=VALUE", in order. Raises InputError like `changed`."""
    for text in assignments:
        settings = settings.changed(*parse_assignment(text))
    return settings


def assignment(path: str, value: Any) -> str:
    """Returns "PATH=VALUE", from which `parse_assignment` returns the same value, to the last bit."""
    if path == "order" and not any("," in name for name in value):
        value = ",".join(value)
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=_plain)
    if isinstance(value, str):
        plain = f"{path}={value}"
        if value and "\n" not in value and _parsed(plain) == value:
            return plain
    return f"{path}={text}"


def _plain(value: Any) -> Any:
    return value.item()  # NumPy's integers and booleans


def _parsed(text: str) -> Any:
    try:
        return parse_assignment(text)[1]
    except InputError:
        return None


def differences(own: SceneSettings, settings: SceneSettings) -> tuple[str, ...]:
    """Returns the assignments that turn a scene's own settings into other settings of the same scene.

    The controller comes first, so that a setting that the controller determines (its rate) is listed only if
    it differs from that of the controller.

    Args:
        own: settings of the scene as it is loaded.
        settings: settings after some events.

    Raises:
        InputError: assignments cannot express the difference.
    """
    now, texts = own, list[str]()

    def tell(path: str, value: Any) -> None:
        nonlocal now
        texts.append(assignment(path, value))
        now = now.changed(*parse_assignment(texts[-1]))

    if settings.controller != own.controller:
        tell("controller", settings.controller)
    for path, value in own.recomposed(settings):
        tell(path, value)
    for path in sorted(path for path, setting in now.table().items() if not setting.shorthand):
        value = settings.value_at(path)
        if value != now.value_at(path):
            tell(path, value)
    for path, value in now.special_differences(settings):
        tell(path, value)
    if now != settings:
        raise InputError("these settings cannot be written as assignments: reset them and try again")
    return tuple(texts)
