"""A user who sends messages that no browser would send, at the wrong moments, by the page's protocol. The
page must keep working. `benchmarks.fuzz` judges the torques under hostile states, settings and events.

    python -m benchmarks.hostile [--minutes M] [--seed N] [--scene S]

Every action is done at least once; then actions are chosen at random. After each action everything that
happened is judged, and the attack ends early after a fault. The program prints all actions as JSON. The exit
code is 1 if there was a fault.
"""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any, final

import tyro

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import msgspec
import numpy as np
from websockets.exceptions import ConnectionClosed

from app.client.recording import Recording
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.ring import Block
from app.web.server import PageServer, ServerOptions
from browsing.wire import Wire, camera, eventually, pack
from lessons.scenes.run_spec import RunSpec

ANSWER = 60.0
"""Time, s, after which a page counts as dead if it shows nothing new although its robot should move."""
COMPLAINTS = ("Traceback", "Exception", "Warning", "[viser]")
"""Words on the terminal that are faults."""
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


@dataclass
class Findings:
    """The actions of a random walk and the faults that it found."""

    seed: int
    actions: Counter[str] = field(default_factory=Counter)
    rows: int = 0
    scenes: dict[str, None] = field(default_factory=dict)
    lessons: dict[str, None] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    def blame(self, sentence: str) -> None:
        if sentence not in self.faults:
            self.faults.append(sentence)


def attack(scene: str, seconds: float, seed: int, pages: int = 4) -> Findings:
    """Lets a user act on a new server for a time, with each action at least once. It ends early after a
    fault."""
    found = Findings(seed)
    with StandardError() as terminal:
        server = PageServer(SceneChoice(RunSpec(scene)), ServerOptions(port=0, max_sessions=pages, grace=0.2))
        try:
            user, judge = HostileUser(server, found), Judge(server, found)
            try:
                end = time.monotonic() + seconds
                while (time.monotonic() < end or not user.once_all) and not found.faults:
                    user.act()
                    judge.look(user, terminal.read())
                if not found.faults and not user.answers():
                    found.blame("the page does not answer any more")
                judge.look(user, terminal.read())
            finally:
                user.close()
        finally:
            server.close()
    return found


class Judge:
    """Judges everything that happened since the last look: the terminal, the simulations, and their rows."""

    def __init__(self, server: PageServer, found: Findings) -> None:
        self.found, self._server = found, server
        self._seen = 0
        self._block: Block | None = None
        self._moved = (time.monotonic(), -1)

    def look(self, user: HostileUser, said: str) -> None:
        """Adds all faults. said: everything that was written to standard error so far."""
        for word in COMPLAINTS:
            if word in said:
                self.found.blame("on the terminal: " + said[max(0, said.index(word) - 200) :][:2500])
        user.look()
        for learner in self._server.sessions.learners:
            if learner.failure is not None:
                self.found.blame(f"the simulation: {learner.failure}")
            if learner.ready is not None:
                self.found.scenes[learner.choice.run.scene] = None
            if learner.lecture is not None:
                self.found.lessons[learner.lecture.exercise.lesson] = None
        for learner in self._server.sessions.learners[:1]:
            learner.read(lambda recording: self._judge(learner, recording))  # noqa: B023
            self._is_alive(learner)

    def _judge(self, learner: SimulationClient, recording: Recording) -> None:
        block = recording.block
        if block is not self._block:
            self._block, self._seen = block, 0
        start, rows = block.since(self._seen)
        self._seen = start + len(rows)
        self.found.rows += len(rows)
        if not len(rows):
            return
        fields, where = recording.layout.fields, _where(learner)
        for name in ("q", "v", "tau"):
            if not np.isfinite(rows[:, fields[name]]).all():
                self.found.blame(f"{name} is not a number in {where}")

    def _is_alive(self, learner: SimulationClient) -> None:
        status, now = learner.status, time.monotonic()
        ticks = -1 if status is None else status.ticks
        if (status is not None and not status.running) or ticks != self._moved[1]:
            self._moved = (now, ticks)
        if now - self._moved[0] > ANSWER:
            speeds = (
                "" if status is None else f", {status.speed:g} and {status.real_time_factor:.2g} × real time"
            )
            self.found.blame(f"no new tick after tick {ticks} for {ANSWER:g} s in {_where(learner)}{speeds}")


def _where(learner: SimulationClient) -> str:
    ready, settings = learner.ready, learner.settings
    return f"{ready.choice.run.scene if ready else '?'} with {settings.controller if settings else '?'}"


class StandardError:
    """Stores what this process and its children write to standard error, and passes it on."""

    def __enter__(self) -> StandardError:
        self._file = tempfile.TemporaryFile()
        self._before = os.dup(2)
        sys.stderr.flush()
        os.dup2(self._file.fileno(), 2)
        return self

    def read(self) -> str:
        sys.stderr.flush()
        size = os.fstat(self._file.fileno()).st_size
        return os.pread(self._file.fileno(), size, 0).decode(errors="replace")

    def __exit__(self, *_: object) -> None:
        said = self.read()
        os.dup2(self._before, 2)
        os.close(self._before)
        self._file.close()
        sys.stderr.write(said)


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


class HostileUser:
    """One connection. Normal actions change the state of the page for the next action."""

    def __init__(self, server: PageServer, found: Findings) -> None:
        self.server, self.found, self.odd = server, found, Odd(found.seed)
        self._due = [each for each, _ in self.table()]
        self.odd.shuffle(self._due)
        self.once_all = False
        self.page = Wire(server.link)
        if not eventually(lambda: self.page.shows("t = ")):
            found.blame("the page does not begin")

    def table(self) -> Actions:
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
            (self._reload, 0.1),
        )

    def act(self) -> None:
        """Does an action, which may come too late for the page."""
        if not self._due:
            self.once_all = True
            actions, weights = zip(*self.table(), strict=True)
            self._due = self.odd.choices(actions, weights)
        action = self._due.pop()
        self.found.actions[action.__name__.strip("_")] += 1
        try:
            action()
            time.sleep(self.odd.choice((0.0, 0.0, 0.01, 0.05, 0.3)))
        except ConnectionClosed:
            self._reload()

    def look(self) -> None:
        """Adds the faults of the page."""
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


def main(minutes: float = 1.0, seed: int = 0, scene: str = "iiwa14-hold") -> int:
    """Does what the module says."""
    found = attack(scene, 60.0 * minutes, seed)
    print(json.dumps(vars(found) | {"scenes": list(found.scenes), "lessons": list(found.lessons)}, indent=1))
    return 1 if found.faults else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
