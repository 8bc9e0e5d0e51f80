"""A user who sends messages that no browser would send, at the wrong moments. It uses the page's protocol."""

from __future__ import annotations

import math
import random
import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
from websockets.exceptions import ConnectionClosed

from app.server.server import PageServer
from benchmarks.findings import Findings
from browsing.wire import Wire, camera, eventually, pack

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


class HostileUser:
    """One connection with one stream of random numbers."""

    def __init__(self, url: str, seed: int) -> None:
        self.actions: Counter[str] = Counter()
        self._url, self._random = url, random.Random(seed)
        self.page = Wire(url)
        self._due = [each for each, _ in self._actions()]
        self._random.shuffle(self._due)

    @property
    def once_all(self) -> bool:
        """Whether every action was done at least once."""
        return sum(self.actions.values()) >= len(self._actions())

    def act(self) -> None:
        """Does one hostile action, or one that a learner may do, so that the next action meets another state
        of the page. Each is done once, then at random."""
        actions = self._actions()
        if not self._due:
            self._due = self._random.choices([each for each, _ in actions], [weight for _, weight in actions])
        chosen = self._due.pop()
        try:
            chosen()
            time.sleep(self._random.choice((0.0, 0.0, 0.01, 0.05, 0.3)))
        except ConnectionClosed:
            self.reload()
        self.actions[chosen.__name__.strip("_")] += 1

    def _actions(self) -> Sequence[tuple[Callable[[], None], float]]:
        """The actions and their weights."""
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
            (self.reload, 0.1),
        )

    def close(self) -> None:
        """Closes the tab."""
        self.page.__exit__()

    # ---------------------------------------------------------------- numbers

    def _number(self) -> float:
        return self._random.choice(NUMBERS) if self._random.random() < 0.5 else self._random.gauss(0.0, 1.0)

    def _numbers(self, count: int) -> tuple[Any, ...]:
        """A number of values, usually the right number."""
        chance = self._random.random()
        if chance < 0.05:
            return tuple(self._number() for _ in range(self._random.randrange(7)))
        if chance < 0.1:
            return tuple(self._random.choice(ODD) for _ in range(count))
        return tuple(self._number() for _ in range(count))

    def _place(self) -> tuple[float, ...]:
        """A position that a user may drag to."""
        return tuple(self._random.uniform(-1.2, 1.2) for _ in range(3))

    def _turn(self) -> tuple[float, ...]:
        return tuple(self._random.gauss(0.0, 1.0) for _ in range(4))

    # ---------------------------------------------------------------- the 3D view

    def _look(self) -> None:
        """Sends a camera message with one or two unusual fields."""
        said = vars(camera())
        for _ in range(self._random.choice((1, 1, 2))):
            match self._random.randrange(6):
                case 0:
                    said["look_at"] = said["position"] = self._place()
                case 1:
                    said[self._random.choice(("position", "look_at", "up_direction"))] = self._numbers(3)
                case 2:
                    said["wxyz"] = self._numbers(4)
                case 3:
                    size = self._random.choice((0, -1, 1, 10**9))
                    said[self._random.choice(("image_height", "image_width"))] = size
                case 4:
                    said[self._random.choice(("fov", "near", "far"))] = self._number()
                case _:
                    # From the position that the page itself set.
                    said["look_at"] = self.page.eye or self._place()
        self._send("ViewerCameraMessage", said)

    def _look_while_built(self) -> None:
        """Loads another scene; until it is built the camera looks at its own position, or has no size."""
        odd, before = self._random.choice(LOOKS), len(self.page.made)
        self._choose_scene()
        for _ in range(100):
            self._send("ViewerCameraMessage", vars(camera()) | odd)
            time.sleep(0.05)
            if len(self.page.made) > before + 20 or self.page.shows("cannot be shown"):
                return

    def _drag(self) -> None:
        name = self._one(self.page.controls_3d)
        if name is None:
            return
        stale = self._random.random() < 0.05
        for _ in range(self._random.choice((1, 1, 5))):
            odd = self._random.random() < 0.3
            said = {
                "name": "/nothing/here" if stale else name,
                "wxyz": self._numbers(4) if odd else self._turn(),
                "position": self._numbers(3) if odd else self._place(),
                "owner": self.page.controls_3d[name],
            }
            if self._random.random() < 0.2:
                phase = self._random.choice(("Start", "End"))
                self._send(f"TransformControlsDrag{phase}Message", {k: said[k] for k in ("name", "owner")})
            self._send("TransformControlsUpdateMessage", said)

    def _pull(self) -> None:
        name = self._one(self.page.meshes)
        if name is None:
            return
        for phase in self._random.choice(
            (("start", "update", "end"), ("update", "start"), ("end",), ("hold",))
        ):
            odd = self._random.random() < 0.3
            said: dict[str, Any] = {
                "phase": phase,
                "name": name,
                "instance_index": self._random.choice((None, 0, -1, 10**12)),
                "start_position": self._numbers(3) if odd else self._place(),
                "start_screen_pos": (0.5, 0.5),
                "end_position": self._numbers(3) if odd else self._place(),
                "end_screen_pos": (self._number(), 0.5),
                "button": self._random.choice(("left", "left", "left", "thumb")),
                "modifier": None,
                "owner": self.page.meshes[name],
            }
            self._send("SceneNodeDragMessage", said)
        said = {
            "name": name,
            "instance_index": None,
            "ray_origin": self._numbers(3),
            "ray_direction": self._numbers(3),
            "screen_pos": (0.5, 0.5),
            "modifier": None,
            "owner": self.page.meshes[name],
        }
        self._send("SceneNodeClickMessage", said)

    # ---------------------------------------------------------------- the panels

    def _inputs(self) -> list[tuple[str, dict[str, Any]]]:
        return [(uuid, each) for uuid, each in list(self.page.controls.items()) if "value" in each]

    def _write_odd(self) -> None:
        inputs = self._inputs()
        if not inputs:
            return
        uuid = self._random.choice(inputs)[0]
        if self._random.random() < 0.2:
            uuid = self._random.choice(list(self.page.made))["uuid"]  # the control may be gone
        name = self._random.choice(
            ("value",) * 8 + ("label", "min", "options", "removed", "__class__", "order")
        )
        self._send("GuiUpdateMessage", {"uuid": uuid, "updates": {name: self._random.choice(ODD)}})

    def _write_fitting(self) -> None:
        """Writes a value that a learner may set."""
        inputs = self._inputs()
        if inputs:
            uuid, control = self._random.choice(inputs)
            self._set(uuid, control)

    def _set(self, uuid: str, control: dict[str, Any]) -> None:
        props, value = control["props"], control["value"]
        match control["type"]:
            case "GuiDropdownMessage" | "GuiButtonGroupMessage":
                value = self._random.choice(list(props["options"]) or [""])
            case "GuiCheckboxMessage":
                value = self._random.random() < 0.5
            case "GuiSliderMessage" | "GuiNumberMessage":
                low, high = props.get("min"), props.get("max")
                low = -10.0 if low is None else low
                high = low + 10.0 if high is None else high
                value = self._random.choice((low, high, low + self._random.random() * (high - low)))
            case "GuiVector3Message" | "GuiVector2Message":
                value = self._place()[: len(value)]
            case "GuiTextMessage":
                value = self._random.choice(("a", "", "0 0 1", "[1, 2]", "x" * 5000, "nan", "(awake)", "🤖"))
            case _:
                return
        self._send("GuiUpdateMessage", {"uuid": uuid, "updates": {"value": value}})

    def _press(self) -> None:
        kinds = ("GuiButtonMessage", "GuiButtonGroupMessage")
        buttons = [(uuid, each) for uuid, each in list(self.page.controls.items()) if each["type"] in kinds]
        if not buttons:
            return
        uuid, control = self._random.choice(buttons)
        if control["type"] == "GuiButtonMessage":
            for _ in range(self._random.choice((1, 1, 3))):
                self._send("GuiUpdateMessage", {"uuid": uuid, "updates": {"value": True}})
        else:
            self._set(uuid, control)

    def _key(self) -> None:
        uuid = self._one(self.page.commands)
        if uuid is not None:
            for _ in range(self._random.choice((1, 1, 4))):
                self._send("CommandTriggerMessage", {"uuid": uuid})

    def _labelled(self, label: str) -> list[tuple[str, dict[str, Any]]]:
        return [each for each in self._inputs() if each[1]["props"].get("label") == label]

    def _axes_then_reset(self) -> None:
        """Changes the axes or the frame of a task, and resets the robot at once."""
        menus = self._labelled("Axes") or self._labelled("Frame")
        if menus:
            self._set(*self._random.choice(menus))
            time.sleep(self._random.choice((0.0, 0.02, 0.1)))
        self._reset()

    def _reset(self) -> None:
        for uuid, _ in self._labelled("Playback"):
            choice = self._random.choice(("Reset", "Reset", "Run", "Pause", "Step", "Reset all"))
            self._send("GuiUpdateMessage", {"uuid": uuid, "updates": {"value": choice}})

    def _drag_while_rebuilt(self) -> None:
        """Changes the stack, and continues to drag arrows that are being replaced."""
        menus = [*self._labelled("Axes"), *self._labelled("Frame"), *self._labelled("Seen from")]
        if menus:
            self._set(*self._random.choice(menus))
        for _ in range(12):
            self._drag()
            time.sleep(0.01)

    def _choose_scene(self) -> None:
        for uuid, control in self._labelled("Scene"):
            self._set(uuid, control)
        for uuid, control in list(self.page.controls.items()):
            if control["props"].get("label") == "Load scene":
                self._send("GuiUpdateMessage", {"uuid": uuid, "updates": {"value": True}})

    # ---------------------------------------------------------------- everything else

    def _upload(self) -> None:
        buttons = [
            u for u, each in list(self.page.controls.items()) if each["type"] == "GuiUploadButtonMessage"
        ]
        uuid = self._random.choice(buttons or ["nothing"])
        name, size = f"file{self._random.randrange(10**9)}", self._random.choice((0, 10, 1000, 10**13, -1))
        parts = self._random.choice((0, 1, 2, 10**6, -1))
        content = self._random.choice(
            (b"", b"<robot", b"\xff" * 10, b"<robot name='r'><link name='a'/></robot>")
        )
        names = ("r.urdf", "", "x" * 5000, "../../etc/passwd", "\x00")
        began = {
            "source_component_uuid": uuid,
            "transfer_uuid": name,
            "filename": self._random.choice(names),
            "mime_type": "text/xml",
            "part_count": parts,
            "size_bytes": size if self._random.random() < 0.5 else len(content),
        }
        self._send("FileTransferStartUpload", began)
        for place in self._random.choice(((0,), (1, 0), (0, 0), (-1, 10**12))):
            part = {
                "source_component_uuid": uuid,
                "transfer_uuid": name,
                "part_index": place,
                "content": content,
            }
            self._send("FileTransferPart", part)

    def _store(self) -> None:
        said = {
            "value": self._random.choice(ODD),
            "error": None,
            "request_uuid": self._random.choice(("", "a")),
        }
        self._send("LocalStorageGetItemResponseMessage", said)

    def _babble(self) -> None:
        match self._random.randrange(4):
            case 0:
                self.page.send(self._random.randbytes(self._random.choice((0, 1, 30, 3000))))
            case 1:
                self.page.send(b"\x91" * self._random.choice((10, 100_000)))  # a deeply nested list
            case 2:
                names = ("uuid", "name", "updates", "value", "owner", "position", "content", "source")
                said = {self._random.choice(names): self._random.choice(ODD) for _ in range(3)}
                self._send(self._random.choice(KINDS), said)
            case _:
                self.page.send(pack(camera())[: self._random.randrange(60)])

    def reload(self) -> None:
        """Reloads the page of the same user, with empty storage."""
        self.page.__exit__()
        self.page = Wire(self._url)

    # ---------------------------------------------------------------- sending

    def _one(self, among: dict[str, Any]) -> str | None:
        return self._random.choice(list(among)) if among else None

    def _send(self, kind: object, said: dict[str, Any]) -> None:
        self.page.send(msgspec.msgpack.encode({**said, "type": kind}))


def roam(server: PageServer, seconds: float, seed: int, complaints: Callable[[], str]) -> Findings:
    """Runs a hostile user for a time, with each action at least once; it ends early after a fault.

    complaints: everything that was written to standard error so far.
    """
    found = Findings(seed)
    user = HostileUser(server.link, seed)
    try:
        if not eventually(lambda: user.page.shows("t = ")):
            found.blame("the page does not begin")
        end = time.monotonic() + seconds
        while (time.monotonic() < end or not user.once_all) and not found.faults:
            user.act()
            _look(server, user.page, found, complaints)
        if not found.faults and not _answers(server, user):
            found.blame("the page does not answer any more")
        _look(server, user.page, found, complaints)
    finally:
        user.close()
    found.actions = user.actions
    return found


def _look(server: PageServer, page: Wire, found: Findings, complaints: Callable[[], str]) -> None:
    """Checks what happened."""
    said = complaints()
    for word in ("Traceback", "Exception", "Warning", "[viser]"):
        if word in said:
            found.blame("on the terminal: " + said[max(0, said.index(word) - 200) :][:2500])
            return
    if page.shows("cannot be shown"):
        found.blame("the page ended")
    for learner in server.sessions.learners:
        if learner.failure is not None:
            found.blame(f"the simulation: {learner.failure}")
        if learner.ready is not None:
            found.scenes.add(learner.choice.run.scene)


def _answers(server: PageServer, user: HostileUser) -> bool:
    """Whether a new page shows the session and accepts a command."""
    user.reload()
    if not eventually(lambda: user.page.find("Playback") is not None and bool(server.sessions.learners)):
        return False
    learner = server.sessions.learners[-1]

    def stepped() -> bool:
        before = -1 if learner.status is None else learner.status.ticks
        button = user.page.find("Playback")
        if button is not None:
            user.page.write(button, value="Step")
        return eventually(lambda: learner.status is not None and learner.status.ticks != before, 2.0)

    return eventually(stepped)
