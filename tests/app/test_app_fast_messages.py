"""Messages of the fast classes are serialised exactly as viser's own messages."""

from __future__ import annotations

from typing import Any

import pytest
from viser import _messages

from app.adapter.private import fast

SENT = (
    (_messages.SetPositionMessage, ("/robot/1", (0.1, -0.2, 0.3))),
    (_messages.SetOrientationMessage, ("/robot/1", (1.0, 0.0, 0.0, 0.0))),
)


@pytest.mark.parametrize(("kind", "fields"), SENT)
def test_a_plain_message_is_visers_own(kind: type[Any], fields: tuple[object, ...]) -> None:
    ours, own = fast(kind)(*fields), kind(*fields)
    assert isinstance(ours, kind) and type(ours).as_serializable_dict is not kind.as_serializable_dict
    assert ours.as_serializable_dict([]) == own.as_serializable_dict([])
    assert ours.redundancy_key() == own.redundancy_key()
    assert ours.entity_state_key() == own.entity_state_key()
