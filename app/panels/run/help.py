"""The last tab: the keys, the meaning of the drawings, and the glossary."""

from __future__ import annotations

import viser

from app.html.markdown import words
from app.html.text import block
from app.panels.widgets.command import PopupWindow

_KEYS = (
    ("Space", "run or pause"),
    ("T", "a single control tick (pauses first)"),
    ("R", "reset the robot to its start; settings stay"),
    ("J, K", "while paused: look back and forward, with Shift in larger steps"),
    ("G", "switch pulling by hand on or off: drag any link; the red arrow shows the force"),
    ("F", "turn the camera to the whole robot"),
    ("L", "all lessons"),
    ("P, N, B", "in a lesson: play the step's script, next step, previous step"),
    ("?", "this help"),
    ("1 … 9", "switch the level with this number on or off"),
    ("Ctrl K", "every command, searchable"),
    (
        "↑ ↓ in a field",
        "move a target, goal or obstacle by one step: see Move a target by keys in the tab Learn",
    ),
    ("W A S D Q E", "the camera goes forward, left, back, right, down, up; the arrow keys turn it"),
    ("", "a field or checkbox that you have used receives all keys until you click beside it"),
)
_MARKS = (
    ("Q, R", "weights of the residual and of the changes of torque"),
    (
        "dynamic leak",
        "the leak, computed with the plant's true inertia instead of M̄; it shows the effect of a wrong M̄",
    ),
    (
        "fallback",
        "the fallback that was applied when a QP had no valid solution; all values except 'solved' are red",
    ),
    ("δ", "HTMPC: the amount by which lower levels may enlarge a higher level's error, up to |e*| + δ"),
    ("window", "HTMPC: the mission's tasks that the controller performs now, highest priority first"),
    ("slower than real time", "this computer cannot keep up; no tick is skipped"),
)
_DRAWN = (
    (
        "ball with arrows",
        "the target that you can drag: its arrows move it along the world's axes; its rings turn it while "
        "the orientation level is on",
    ),
    ("line to the ball", "the way that the hand still has to its target, with its length"),
    ("small frame with a ball", "the filtered target for the controller (limited speed and acceleration)"),
    ("large thin frame", "the actual pose of the hand"),
    ("line behind the hand", "the path of the hand in the last seconds"),
    ("pink line", "the predicted path of the hand, enlarged by the factor in its label"),
    ("ball, disc with arrows", "mobile robots: the goals of the current tasks of the hand and of the base"),
    ("circle", "mobile robots: the reach of the arm around the base"),
)  # fmt: skip


class HelpPanel:
    """A text that never changes. It can also be opened as a window."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self._fill()
        self._window = PopupWindow(gui, "Help", "?", self._fill, shift=True)

    def _fill(self) -> None:
        known = (*words().items(), *_MARKS)
        for title, rows in (("Keys", _KEYS), ("In the scene", _DRAWN), ("Words", known)):
            with self._gui.add_folder(title):
                cells = "".join(
                    f'<tr><td style="vertical-align:top;padding-right:0.8em;max-width:9em"><b>{word}</b>'
                    f"</td><td>{meaning}</td></tr>"
                    for word, meaning in rows
                )
                self._gui.add_html(block(f'<table style="border-spacing:0 0.2em">{cells}</table>'))

    def close(self) -> None:
        self._window.close()
