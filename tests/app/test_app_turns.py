"""The turn of each joint, written at the joint."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np

from app.view.robot import JointTurns


def recording(*rows: tuple[float, float, float]) -> Any:
    """Returns a window with rows of t, q_1 and q_2."""
    values = np.array(rows)
    layout = SimpleNamespace(fields={"t": slice(0, 1), "q": slice(1, 3)})
    return SimpleNamespace(layout=layout, columns=lambda span: values[:, span])


def test_the_turn_since_the_start_is_at_each_joint() -> None:
    """Also if the page saw no picture of the start, as in a run that is as fast as possible."""
    scene = MagicMock()
    labels = scene.add_label.side_effect = [MagicMock(visible=False, text="") for _ in range(2)]
    turns, q, poses = JointTurns(scene, (1, 2)), np.array([0.5, -1.0]), np.arange(21.0).reshape(3, 7)
    unknown, nothing = np.full(2, np.nan), recording((np.nan, np.nan, np.nan))
    turns.draw(0.0, unknown, poses, nothing)
    turns.draw(3.0, q, poses, recording((2.0, *q), (3.0, *q)))
    assert not any(label.visible for label in labels), "a page that opens late does not know the start"
    whole = recording((np.nan, np.nan, np.nan), (0.001, *q), (1.0, 9.0, 9.0))
    turns.draw(1.0, q + np.radians([12.4, -0.26]), poses, whole)
    assert [label.text for label in labels] == ["1: 12°", "2: 0.3°"] and labels[1].visible
    assert labels[1].position == (7.0, 8.0, 9.0)
    turns.draw(1.0, unknown, poses, whole)
    assert not labels[0].visible and "nan" not in labels[0].text
    turns.draw(0.0, q, poses, whole)
    assert not labels[0].visible, "hidden again after a reset"
