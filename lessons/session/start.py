"""A session for a scene of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import overload

from lessons.scenes.scene import Scene, TorqueScene, VelocityScene
from lessons.session.session import Session
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession

SESSIONS: Mapping[type[Scene], type[TorqueSession] | type[VelocitySession]] = {
    TorqueScene: TorqueSession,
    VelocityScene: VelocitySession,
}
"""The session class for each kind of scene."""


@overload
def begin(scene: TorqueScene, seed: int = 0) -> TorqueSession: ...
@overload
def begin(scene: VelocityScene, seed: int = 0) -> VelocitySession: ...
@overload
def begin(scene: Scene, seed: int = 0) -> Session: ...
def begin(scene: Scene, seed: int = 0) -> Session:
    """Starts a session for a scene. Raises InputError if its settings do not fit its robot."""
    return SESSIONS[type(scene)](scene, seed)  # pyright: ignore[reportArgumentType]
