"""The private names of viser that this program uses; each name is checked before the server starts.

viser documents no names of its page. The selectors and objects that our scripts and styles use are constants
of this module. viser's package contains the sources of its page, and the check searches these sources for the
text that each constant depends on.
"""

from __future__ import annotations

from pathlib import Path

import viser

from app.adapter.probe import reaches, require

OF_VISER = {
    "_messages": (
        *("RunJavascriptMessage", "SetPositionMessage", "SetOrientationMessage", "Message"),
        *("GuiUpdateMessage", "ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload"),
        *("LocalStorageGetItemRequestMessage", "LocalStorageGetItemResponseMessage", "FileTransferPart"),
        *("TransformControlsUpdateMessage", "SceneNodeDragMessage", "SceneNodeClickMessage"),
        "ScenePointerMessage",
    ),
    "infra.WebsockClientConnection": ("_handle_incoming_message", "get_message_buffer", "queue_message"),
    "_gui_handles._GuiHandleState": ("uuid", "value", "removed", "gui_api"),
    "_scene_handles._SceneNodeHandleState": ("name", "api", "position", "wxyz"),
    "SceneApi": ("_queue_scene_message",),
    "GuiUplotHandle": ("_queue_update",),
}
OF_A_SERVER = (
    "_websock_server._live_connections",
    "_websock_server._incoming_handlers",
    "_websock_server._client_state_from_id",
    "_websock_server._broadcast_buffer.message_event",
    "_websock_server._broadcast_buffer.message_from_id",
    "_websock_server._broadcast_buffer.window_duration_sec",
    "gui._current_file_upload_states",
    "gui._gui_input_handle_from_uuid",
    "gui._thread_executor",
    "gui._websock_interface",
    "scene._thread_executor",
    "scene._dispatch_callback",
)

PAGE = "window.__viserMutable"
"""The object of viser's page that sends messages."""
CHART, CHART_TITLE = ".uplot", ".u-title"
NUMBER_BOX, SLIDER_LABEL = ".mantine-NumberInput-root", ".mantine-Slider-label"
BUTTON_INNER, BUTTON_LABEL = ".mantine-Button-inner", ".mantine-Button-label"
SHEET = 'div[style*="width: 20em"]'
"""The sheet of controls at the bottom of a phone's screen."""
ROW = ".mantine-Flex-root"
"""A control with its label."""
ICON_BUTTON, CLOSES_NOTICE = ".mantine-ActionIcon-root", ".mantine-Notification-closeButton"
SCROLLS = ".mantine-ScrollArea-viewport"
STORED = "viser-user:"
"""The prefix that viser adds to the keys of values that a browser stores."""
OF_THE_PAGE = (
    ("MessageHandler.tsx", f'LOCAL_STORAGE_PREFIX = "{STORED}"'),
    ("components/common.tsx", '<Flex align="center">'),
    ("components/common.tsx", "<label htmlFor={props.uuid}>"),
    ("App.tsx", "w.__viserMutable = mutable.current"),
    ("WebsocketInterface.tsx", "viewerMutable.sendMessage = (message)"),
    ("components/UplotComponent.css", f"{CHART} {CHART_TITLE} {{"),
    ("components/Slider.tsx", 'import { Slider, Flex, NumberInput } from "@mantine/core"'),
    ("components/Slider.tsx", "id={uuid}"),
    ("components/Button.tsx", 'import { Button } from "@mantine/core"'),
    ("components/Button.tsx", "id={uuid}"),
    ("ControlPanel/BottomPanel.tsx", 'width: "20em"'),
)
"""Pairs: a file below viser's `client/src`, and a text that this file must contain."""


def check_names() -> None:
    """Checks the names that can be checked without a server. Raises InputError if viser lacks one of
    them."""
    for place, names in OF_VISER.items():
        for name in names:
            require(reaches(viser, f"{place}.{name}"), name)
    sources = Path(viser.__file__).parent / "client" / "src"
    for file, words in OF_THE_PAGE:
        path = sources / file
        require(path.is_file() and words in path.read_text("utf-8"), words)
