"""A user who sends messages that no browser would send, at the wrong moments, by the page's protocol."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from random import Random
from typing import Any, final

import msgspec
from websockets.exceptions import ConnectionClosed

from app.web.server import PageServer
from benchmarks.monkey import Findings, User
from browsing.wire import Wire, camera, eventually, pack

ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 3.7, math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, 2**63 - 1, -(2**63),
    "", "word", "nan", "x" * 300_000, "\x00", "🤖" * 50, [], [1], [1, 2, 3], [1, 2, 3, 4], [math.nan] * 3,
    [1e308] * 3, [[[[1]]]], {}, {"a": 1}, b"bytes",
)  # fmt: skip
NUMBERS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e6, 1e7, 1e308, math.nan, math.inf, -math.inf)
TEXTS = ("a", "", "0 0 1", "[1, 2]", "x" * 5000, "nan", "(awake)", "🤖")
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
Actions = Sequence[tuple[Callable[[], None], float]]
Control = tuple[str, dict[str, Any]]
"""The id of a control, and the message that created it."""


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

    def place(self, odd: bool = False) -> tuple[float, ...]:
        """Returns a position that a user may drag to, m."""
        return self.numbers(3) if odd else tuple(self.uniform(-1.2, 1.2) for _ in range(3))

    def turn(self, odd: bool = False) -> tuple[float, ...]:
        """Returns a quaternion that is not normalised."""
        return self.numbers(4) if odd else tuple(self.gauss(0.0, 1.0) for _ in range(4))

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


class HostileUser(User):
    """One connection. Normal actions change the state of the page for the next action."""

    complaints = ("Traceback", "Exception", "Warning", "[viser]")

    def __init__(self, server: PageServer, found: Findings) -> None:
        self.odd = Odd(found.seed)
        super().__init__(server, found, self.odd)
        self.page = Wire(server.link)
        if not eventually(lambda: self.page.shows("t = ")):
            found.blame("the page does not begin")

    def table(self) -> Actions:
        return (
            (self._look, 3.0),
            (self._write_odd, 4.0),
            (self._write_fitting, 6.0),
            (self._press, 2.0),
            (self._key, 1.5),
            (self._drag, 5.0),
            (self._pull, 2.0),
            (self._axes_then_reset, 2.0),
            (self._drag_while_rebuilt, 2.0),
            (self._look_while_built, 1.0),
            (self._upload, 1.0),
            (self._store, 1.0),
            (self._babble, 2.0),
            (self._reload, 0.1),
        )

    def do(self, action: Callable[[], None]) -> None:
        try:
            action()
            time.sleep(self.odd.choice((0.0, 0.0, 0.01, 0.05, 0.3)))
        except ConnectionClosed:
            self._reload()

    def look(self) -> None:
        if self.page.shows("cannot be shown"):
            self.found.blame("the page ended")

    def answers(self) -> bool:
        """Returns whether a new page shows the session and accepts a command."""
        self._reload()
        learners = self.server.sessions
        if not eventually(lambda: self.page.find("Playback") is not None and bool(learners.learners)):
            return False
        learner = learners.learners[-1]

        def stepped() -> bool:
            before = -1 if learner.status is None else learner.status.ticks
            button = self.page.find("Playback")
            if button is not None:
                self.page.write(button, value="Step")
            return eventually(lambda: learner.status is not None and learner.status.ticks != before, 2.0)

        return eventually(stepped)

    def close(self) -> None:
        self.page.__exit__()

    # ---------------------------------------------------------------- the 3D view

    def _look(self) -> None:
        """Sends a camera message with one or two unusual fields."""
        said, choice = vars(camera()), self.odd.choice
        for _ in range(choice((1, 1, 2))):
            match self.odd.randrange(6):
                case 0:
                    said["look_at"] = said["position"] = self.odd.place()
                case 1:
                    odd = self.odd.numbers(3)
                    said[choice(("position", "look_at", "up_direction"))] = odd
                case 2:
                    said["wxyz"] = self.odd.numbers(4)
                case 3:
                    size = choice((0, -1, 1, 10**9))
                    said[choice(("image_height", "image_width"))] = size
                case 4:
                    said[choice(("fov", "near", "far"))] = self.odd.number()
                case _:
                    # The camera looks at the position that the page gave to it.
                    said["look_at"] = self.page.eye or self.odd.place()
        self._send("ViewerCameraMessage", **said)

    def _look_while_built(self) -> None:
        """Loads another scene. Until that is built, the camera looks at its own position or has no size."""
        odd, before = self.odd.choice(LOOKS), len(self.page.made)
        for control in self._labelled("Scene"):
            self._set(*control)
        for uuid, control in self._controls():
            if control["props"].get("label") == "Load scene":
                self._write(uuid, True)
        for _ in range(100):
            self._send("ViewerCameraMessage", **(vars(camera()) | odd))
            time.sleep(0.05)
            if len(self.page.made) > before + 20 or self.page.shows("cannot be shown"):
                return

    def _drag(self) -> None:
        if not self.page.controls_3d:
            return
        name = self.odd.choice(list(self.page.controls_3d))
        stale = self.odd.random() < 0.05
        for _ in range(self.odd.choice((1, 1, 5))):
            odd = self.odd.random() < 0.3
            node: dict[str, Any] = {"name": "/nothing/here" if stale else name}
            turn, place = self.odd.turn(odd), self.odd.place(odd)
            node["owner"] = self.page.controls_3d[name]
            if self.odd.random() < 0.2:
                self._send(f"TransformControlsDrag{self.odd.choice(('Start', 'End'))}Message", **node)
            self._send("TransformControlsUpdateMessage", wxyz=turn, position=place, **node)

    def _pull(self) -> None:
        if not self.page.meshes:
            return
        name = self.odd.choice(list(self.page.meshes))
        node = {"name": name, "owner": self.page.meshes[name], "modifier": None}
        for phase in self.odd.choice((("start", "update", "end"), ("update", "start"), ("end",), ("hold",))):
            odd = self.odd.random() < 0.3
            self._send(
                "SceneNodeDragMessage",
                phase=phase,
                instance_index=self.odd.choice((None, 0, -1, 10**12)),
                start_position=self.odd.place(odd),
                start_screen_pos=(0.5, 0.5),
                end_position=self.odd.place(odd),
                end_screen_pos=(self.odd.number(), 0.5),
                button=self.odd.choice(("left", "left", "left", "thumb")),
                **node,
            )
        ray = {"ray_origin": self.odd.numbers(3), "ray_direction": self.odd.numbers(3)}
        self._send("SceneNodeClickMessage", instance_index=None, screen_pos=(0.5, 0.5), **ray, **node)

    # ---------------------------------------------------------------- the panels

    def _controls(self) -> list[Control]:
        return list(self.page.controls.items())

    def _inputs(self) -> list[Control]:
        return [each for each in self._controls() if "value" in each[1]]

    def _labelled(self, *labels: str) -> list[Control]:
        return [each for each in self._inputs() if each[1]["props"].get("label") in labels]

    def _write(self, uuid: str, value: object, name: str = "value") -> None:
        self._send("GuiUpdateMessage", uuid=uuid, updates={name: value})

    def _write_odd(self) -> None:
        inputs = self._inputs()
        if not inputs:
            return
        uuid = self.odd.choice(inputs)[0]
        if self.odd.random() < 0.2:
            uuid = self.odd.choice(list(self.page.made))["uuid"]  # the control may have been removed
        name = self.odd.choice(
            ("value",) * 8 + ("label", "min", "options", "removed", "__class__", "order")
        )  # fmt: skip
        self._write(uuid, self.odd.choice(ODD), name)

    def _write_fitting(self) -> None:
        """Writes a value that a learner may set."""
        inputs = self._inputs()
        if inputs:
            self._set(*self.odd.choice(inputs))

    def _set(self, uuid: str, control: dict[str, Any]) -> None:
        props, value = control["props"], control["value"]
        match control["type"]:
            case "GuiDropdownMessage" | "GuiButtonGroupMessage":
                value = self.odd.choice(list(props["options"]) or [""])
            case "GuiCheckboxMessage":
                value = self.odd.random() < 0.5
            case "GuiSliderMessage" | "GuiNumberMessage":
                low, high = props.get("min"), props.get("max")
                low = -10.0 if low is None else low
                high = low + 10.0 if high is None else high
                value = self.odd.choice((low, high, low + self.odd.random() * (high - low)))
            case "GuiVector3Message" | "GuiVector2Message":
                value = self.odd.place()[: len(value)]
            case "GuiTextMessage":
                value = self.odd.choice(TEXTS)
            case _:
                return
        self._write(uuid, value)

    def _press(self) -> None:
        kinds = ("GuiButtonMessage", "GuiButtonGroupMessage")
        buttons = [each for each in self._controls() if each[1]["type"] in kinds]
        if not buttons:
            return
        uuid, control = self.odd.choice(buttons)
        if control["type"] == "GuiButtonMessage":
            for _ in range(self.odd.choice((1, 1, 3))):
                self._write(uuid, True)
        else:
            self._set(uuid, control)

    def _key(self) -> None:
        if self.page.commands:
            uuid = self.odd.choice(list(self.page.commands))
            for _ in range(self.odd.choice((1, 1, 4))):
                self._send("CommandTriggerMessage", uuid=uuid)

    def _axes_then_reset(self) -> None:
        """Changes the axes or the frame of a task, and resets the robot at once."""
        menus = self._labelled("Axes") or self._labelled("Frame")
        if menus:
            self._set(*self.odd.choice(menus))
            time.sleep(self.odd.choice((0.0, 0.02, 0.1)))
        for uuid, _ in self._labelled("Playback"):
            self._write(uuid, self.odd.choice(("Reset", "Reset", "Run", "Pause", "Step", "Reset all")))

    def _drag_while_rebuilt(self) -> None:
        """Changes the stack, and continues to drag arrows that are being replaced."""
        menus = [*self._labelled("Axes"), *self._labelled("Frame"), *self._labelled("Seen from")]
        if menus:
            self._set(*self.odd.choice(menus))
        for _ in range(12):
            self._drag()
            time.sleep(0.01)

    # ---------------------------------------------------------------- everything else

    def _upload(self) -> None:
        buttons = [uuid for uuid, each in self._controls() if each["type"] == "GuiUploadButtonMessage"]
        uuid = self.odd.choice(buttons or ["nothing"])
        name, size = f"file{self.odd.randrange(10**9)}", self.odd.choice((0, 10, 1000, 10**13, -1))
        file = {"source_component_uuid": uuid, "transfer_uuid": name}
        parts = self.odd.choice((0, 1, 2, 10**6, -1))
        content = self.odd.choice((b"", b"<robot", b"\xff" * 10, b"<robot name='r'><link name='a'/></robot>"))
        self._send(
            "FileTransferStartUpload",
            filename=self.odd.choice(("r.urdf", "", "x" * 5000, "../../etc/passwd", "\x00")),
            mime_type="text/xml",
            part_count=parts,
            size_bytes=size if self.odd.random() < 0.5 else len(content),
            **file,
        )
        for place in self.odd.choice(((0,), (1, 0), (0, 0), (-1, 10**12))):
            self._send("FileTransferPart", part_index=place, content=content, **file)

    def _store(self) -> None:
        value, request = self.odd.choice(ODD), self.odd.choice(("", "a"))
        self._send("LocalStorageGetItemResponseMessage", value=value, error=None, request_uuid=request)

    def _babble(self) -> None:
        self.page.send(self.odd.babble())

    def _reload(self) -> None:
        """Reloads the page of the same user, with empty storage."""
        self.close()
        self.page = Wire(self.server.link)

    def _send(self, kind: str, **said: Any) -> None:
        self.page.send(msgspec.msgpack.encode({**said, "type": kind}))
