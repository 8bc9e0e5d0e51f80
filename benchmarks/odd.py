"""Values, messages and cameras that no browser would send, and random numbers, some of which are invalid."""

from __future__ import annotations

import math
from random import Random
from typing import Any, final

import msgspec

from browsing.wire import camera, pack

ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 3.7, math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, 2**63 - 1, -(2**63),
    "", "word", "nan", "x" * 300_000, "\x00", "🤖" * 50, [], [1], [1, 2, 3], [1, 2, 3, 4], [math.nan] * 3,
    [1e308] * 3, [[[[1]]]], {}, {"a": 1}, b"bytes",
)  # fmt: skip
NUMBERS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e6, 1e7, 1e308, math.nan, math.inf, -math.inf)
KINDS = (
    "ViewerCameraMessage", "GuiUpdateMessage", "GuiFormDirtyMessage", "GuiFormSubmitMessage",
    "ShareUrlRequest", "GuiButtonHoldMessage", "RunJavascriptMessage", "GetRenderResponseMessage",
    "ScenePointerMessage", "TransformControlsUpdateMessage", "SceneNodeDragMessage", "SceneNodeClickMessage",
    "CommandTriggerMessage", "FileTransferStartUpload", "FileTransferPart", "FileTransferPartAck",
    "LocalStorageGetItemResponseMessage", "ResetSceneMessage", "RemoveSceneNodeMessage", "no such message",
    "", 7, None,
)  # fmt: skip

LOOKS: tuple[dict[str, Any], ...] = (
    {"image_height": 0},
    {"look_at": (math.inf, 0.0, 0.0)},
    {"up_direction": (math.nan, 0.0, 1.0)},
    {"look_at": camera().position},
)


@final
class Odd(Random):
    """A stream of random numbers and messages, some of which are invalid."""

    def number(self) -> float:
        """Returns a random number; every second one is taken from `NUMBERS`."""
        return self.choice(NUMBERS) if self.random() < 0.5 else self.gauss(0.0, 1.0)

    def numbers(self, count: int) -> tuple[Any, ...]:
        """Returns several values, usually the right number of them."""
        chance = self.random()
        if chance < 0.05:
            return tuple(self.number() for _ in range(self.randrange(7)))
        if chance < 0.1:
            return tuple(self.choice(ODD) for _ in range(count))
        return tuple(self.number() for _ in range(count))

    def place(self) -> tuple[float, ...]:
        """Returns a position that a user may drag to, m."""
        return tuple(self.uniform(-1.2, 1.2) for _ in range(3))

    def turn(self) -> tuple[float, ...]:
        """Returns a quaternion that is not normalised."""
        return tuple(self.gauss(0.0, 1.0) for _ in range(4))

    def babble(self) -> bytes:
        """Returns bytes, or a message that nobody would send."""
        match self.randrange(4):
            case 0:
                return self.randbytes(self.choice((0, 1, 30, 3000)))
            case 1:
                return b"\x91" * self.choice((10, 100_000))  # a deeply nested list
            case 2:
                names = ("uuid", "name", "updates", "value", "owner", "position", "content", "source")
                said = {self.choice(names): self.choice(ODD) for _ in range(3)}
                return msgspec.msgpack.encode({**said, "type": self.choice(KINDS)})
            case _:
                return pack(camera())[: self.randrange(60)]
