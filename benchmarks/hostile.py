"""A user who sends messages that no browser would send, at the wrong moments, by the page's protocol."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
from websockets.exceptions import ConnectionClosed

from benchmarks.odd import LOOKS, ODD, Odd
from browsing.wire import Wire, camera


class HostileUser:
    """One connection with one stream of random numbers."""

    def __init__(self, url: str, seed: int) -> None:
        self.actions: Counter[str] = Counter()
        self._url, self._random = url, Odd(seed)
        self.page = Wire(url)
        self._due = [each for each, _ in self._actions()]
        self._random.shuffle(self._due)

    @property
    def once_all(self) -> bool:
        """Returns whether every action was done at least once."""
        return sum(self.actions.values()) >= len(self._actions())

    def act(self) -> None:
        """Does a hostile action, or a normal action that changes the state of the page for the next action.
        At first every action is done once. After that, actions are chosen at random."""
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
        """Returns the actions and their weights."""
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

    # ---------------------------------------------------------------- the 3D view

    def _look(self) -> None:
        """Sends a camera message with one or two unusual fields."""
        said = vars(camera())
        for _ in range(self._random.choice((1, 1, 2))):
            match self._random.randrange(6):
                case 0:
                    said["look_at"] = said["position"] = self._random.place()
                case 1:
                    odd = self._random.numbers(3)
                    said[self._random.choice(("position", "look_at", "up_direction"))] = odd
                case 2:
                    said["wxyz"] = self._random.numbers(4)
                case 3:
                    size = self._random.choice((0, -1, 1, 10**9))
                    said[self._random.choice(("image_height", "image_width"))] = size
                case 4:
                    said[self._random.choice(("fov", "near", "far"))] = self._random.number()
                case _:
                    # The camera looks at the position that the page gave to it.
                    said["look_at"] = self.page.eye or self._random.place()
        self._send("ViewerCameraMessage", said)

    def _look_while_built(self) -> None:
        """Loads another scene. Until that is built, the camera looks at its own position or has no size."""
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
                "wxyz": self._random.numbers(4) if odd else self._random.turn(),
                "position": self._random.numbers(3) if odd else self._random.place(),
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
                "start_position": self._random.numbers(3) if odd else self._random.place(),
                "start_screen_pos": (0.5, 0.5),
                "end_position": self._random.numbers(3) if odd else self._random.place(),
                "end_screen_pos": (self._random.number(), 0.5),
                "button": self._random.choice(("left", "left", "left", "thumb")),
                "modifier": None,
                "owner": self.page.meshes[name],
            }
            self._send("SceneNodeDragMessage", said)
        said = {
            "name": name,
            "instance_index": None,
            "ray_origin": self._random.numbers(3),
            "ray_direction": self._random.numbers(3),
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
            uuid = self._random.choice(list(self.page.made))["uuid"]  # the control may have been removed
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
                value = self._random.place()[: len(value)]
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
        self.page.send(self._random.babble())

    def reload(self) -> None:
        """Reloads the page of the same user, with empty storage."""
        self.page.__exit__()
        self.page = Wire(self._url)

    # ---------------------------------------------------------------- sending

    def _one(self, among: dict[str, Any]) -> str | None:
        return self._random.choice(list(among)) if among else None

    def _send(self, kind: object, said: dict[str, Any]) -> None:
        self.page.send(msgspec.msgpack.encode({**said, "type": kind}))
