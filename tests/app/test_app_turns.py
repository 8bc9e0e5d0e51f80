"""The turn of each joint, written at the joint."""

from __future__ import annotations

from unittest.mock import MagicMock

import numpy as np

from app.view.turns import JointTurns


def test_the_turn_since_the_start_is_at_each_joint() -> None:
    scene = MagicMock()
    labels = scene.add_label.side_effect = [MagicMock(visible=False, text="") for _ in range(2)]
    turns, q, poses = JointTurns(scene, 2), np.array([0.5, -1.0]), np.arange(21.0).reshape(3, 7)
    turns.draw(3.0, q, poses)
    assert not any(label.visible for label in labels), "a page that opens late does not know the start"
    turns.draw(0.0, q, poses)
    assert not any(label.visible for label in labels)
    turns.draw(1.0, q + np.radians([12.4, -0.26]), poses)
    assert [label.text for label in labels] == ["1: 12°", "2: 0.3°"] and labels[1].visible
    assert labels[1].position == (7.0, 8.0, 9.0)
    turns.draw(0.0, q, poses)
    assert not labels[0].visible, "hidden again after a reset"
