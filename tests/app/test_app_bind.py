"""Controls and settings: no edit is lost when other changes happen at the same moment."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any
from unittest.mock import MagicMock

import pytest
import viser
from viser import _messages

from app.panels.torque.controller import ControllerPanel, HorizonPanel, add_plant
from app.panels.velocity.controller import HtmpcPanel, add_servo_plant
from app.panels.widgets.command import PopupWindow
from app.panels.widgets.controls import _tenth
from app.tab import mirror as bind
from app.tab.mirror import Bindings, PendingEdit
from app.web.inlet import allowed
from lessons.events import Event, Set
from lessons.scenes.catalog import load_scene, torque_scene
from lessons.settings.torque import TorqueSettings
from lessons.settings.velocity import VelocitySettings


@pytest.fixture
def settings() -> TorqueSettings:
    return torque_scene("planar3-hold").settings


class Panel:
    """A slider of N with its bindings, and functions that act as a browser through the inlet and viser's own
    handler."""

    def __init__(self, server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> None:
        self.posted: list[Event] = []
        self.gui, self.loop = server.gui, server.get_event_loop()
        monkeypatch.setattr(self.gui, "_resolve_client", lambda _: object())
        self.slider = self.gui.add_slider("N", min=1, max=30, step=1, initial_value=5)
        self.bindings = Bindings(self.posted.append, self.loop)
        self.bindings.bind(self.slider, lambda s: s.horizon, lambda value: Set("horizon", int(value)))

    def browser_sets(self, value: int, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Sets the slider. `meanwhile` runs in another thread between the arrival of the value and the
        control's callback."""

        def run(*_: Any) -> None:
            thread = threading.Thread(target=meanwhile)
            thread.start()
            thread.join()

        self.slider._impl.sync_cb = run
        updates = {"value": allowed(self.slider, {"value": value})}
        message = _messages.GuiUpdateMessage(self.slider._impl.uuid, updates)
        asyncio.run_coroutine_threadsafe(self.gui._handle_gui_updates(0, message), self.loop).result(10)  # pyright: ignore

    def refresh(self, settings: TorqueSettings) -> None:
        """Refreshes the bindings and waits until the event loop has run their tasks."""
        self.bindings.refresh(settings)
        done: Future[None] = Future()
        self.loop.call_soon_threadsafe(done.set_result, None)
        done.result(10)


@pytest.fixture
def panel(viser_server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> Panel:
    return Panel(viser_server, monkeypatch)


def test_an_edit_is_not_lost_to_a_refresh_at_the_same_moment(panel: Panel, settings: TorqueSettings) -> None:
    """A value that arrives while the page shows the earlier settings is posted."""
    panel.browser_sets(12, meanwhile=lambda: panel.bindings.refresh(settings))
    assert panel.posted == [Set("horizon", 12)]
    panel.refresh(settings)
    assert panel.slider.value == 12  # the confirmation has not arrived yet


@pytest.mark.parametrize(("typed", "posted"), [(1_000_000, 30), (-4, 1), (30, 30)])
def test_a_number_typed_beyond_the_slider_stays_on_its_scale(panel: Panel, typed: int, posted: int) -> None:
    panel.browser_sets(typed)
    assert panel.posted == [Set("horizon", posted)]


def test_what_changes_elsewhere_is_shown_and_a_refused_edit_taken_back(
    panel: Panel, settings: TorqueSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    panel.refresh(settings.changed("horizon", 9))
    assert panel.slider.value == 9 and panel.posted == []
    panel.browser_sets(12)
    monkeypatch.setattr(bind, "HOLD", 0.0)
    panel.refresh(settings)
    assert panel.slider.value == settings.horizon


def test_controls_are_reminded_of_what_the_session_has(
    panel: Panel, settings: TorqueSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unchanged values are sent again from time to time, so that a change in the browser which was never
    received does not stay on the screen."""
    sent: list[Any] = []
    monkeypatch.setattr(panel.gui._websock_interface, "queue_message", sent.append)
    panel.refresh(replace(settings, horizon=5))
    panel.refresh(replace(settings, horizon=5))
    # not sent again before REMIND s have passed
    assert [message.updates for message in sent] == [{"value": 5}]
    monkeypatch.setattr(bind, "REMIND", 0.0)
    panel.refresh(replace(settings, horizon=5))
    assert len(sent) == 2
    panel.bindings.close()
    panel.refresh(replace(settings, horizon=7))
    assert len(sent) == 2 and panel.slider.value == 5


def test_the_browser_is_told_what_an_edit_became(
    panel: Panel, settings: TorqueSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A value that was sent just before an edit arrives just after it and replaces it on the screen. The
    edited value is sent again: that of a switch at once, so that the next click inverts it; that of a slider
    when nobody has moved it for a while."""
    sent: list[Any] = []
    switch = panel.gui.add_checkbox("Damping", True)
    switch._impl.sync_cb = None  # there is no other browser
    panel.bindings.bind(switch, lambda s: s.damping, lambda on: Set("damping", bool(on)))
    panel.refresh(settings)
    monkeypatch.setattr(panel.gui._websock_interface, "queue_message", sent.append)
    message = _messages.GuiUpdateMessage(switch._impl.uuid, {"value": False})
    asyncio.run_coroutine_threadsafe(panel.gui._handle_gui_updates(0, message), panel.loop).result(10)  # pyright: ignore
    assert [(each.uuid, each.updates) for each in sent] == [(switch._impl.uuid, {"value": False})]
    sent.clear()
    panel.browser_sets(12)
    panel.refresh(settings)
    assert sent == []  # the slider may still be moving
    monkeypatch.setattr(bind, "HOLD", 0.0)
    edited = replace(settings, horizon=12, damping=False)
    panel.refresh(edited)
    panel.refresh(edited)
    assert [(each.uuid, each.updates) for each in sent] == [(panel.slider._impl.uuid, {"value": 12})]


def test_a_wish_counts_until_the_answer_is_due(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two quick presses of a toggle restore its initial state, because an unconfirmed edit counts until HOLD
    s have passed."""
    wish: PendingEdit[bool] = PendingEdit()
    assert wish.now(True) is True
    assert wish.ask(not wish.now(True)) is False
    assert wish.ask(not wish.now(True)) is True
    later = time.monotonic() + bind.HOLD + 1.0
    monkeypatch.setattr(bind.time, "monotonic", lambda: later)
    assert wish.now(False) is False


def test_a_window_whose_page_is_built_anew_meanwhile_is_given_up() -> None:
    """Opening fails because viser has removed the window's containers; the next press opens the window."""
    filled: list[bool] = []

    def fill() -> None:
        filled.append(True)
        if len(filled) == 1:
            raise KeyError("a container that is gone")

    gui: Any = MagicMock()
    gui.add_modal.return_value.__exit__.return_value = False
    window = PopupWindow(gui, "All lessons", "L", fill)
    window.open()
    window.open()
    assert len(filled) == gui.add_modal.call_count == 2
    window.open()  # the window is open already
    assert len(filled) == 2
    window.close()
    gui.add_modal.return_value.close.assert_called_once()


def test_controls_open_on_whatever_is_set(viser_server: viser.ViserServer) -> None:
    """The controls can be created with values beyond the usual range of a slider, which a script, a lesson or
    a code may set."""
    scene = torque_scene("planar3-hold")
    far = scene.settings
    for path, value in (
        ("limits.torque_scale", 0.04),
        ("limits.velocity_scale", 9.0),
        ("M_bar_scale", 0.01),
        ("T_s", 2e-4),
        ("horizon", 60),
        ("M_bar.1", 1e-8),
    ):
        far = far.changed(path, value)
    loop = viser_server.get_event_loop()
    bindings: Bindings[TorqueSettings] = Bindings(lambda _: None, loop)
    page = MagicMock(gui=viser_server.gui, bindings=bindings, settings=far, robot=scene.robot)
    page.client = page
    ControllerPanel(page)
    HorizonPanel(page)
    values = {handle.value for handle in viser_server.gui._gui_input_handle_from_uuid.values()}
    assert {0.04, 9.0, 0.01, 60, 1e-8} <= values


@pytest.mark.parametrize(
    ("name", "longest"), [("panda-hold", 2.0), ("iiwa14-hold", 2.5), ("planar3-hold", 5.0)]
)
def test_the_slider_of_the_period_ends_where_the_arm_would_swing(
    viser_server: viser.ViserServer, name: str, longest: float
) -> None:
    """The end follows M̄ and the controller: half of M̄ halves it, down to 1 ms, and a model has no lag."""
    scene, bindings = torque_scene(name), Bindings(lambda _: None, viser_server.get_event_loop())
    viser_server.gui.reset()
    page = MagicMock(gui=viser_server.gui, bindings=bindings, settings=scene.settings, robot=scene.robot)
    page.client = page
    HorizonPanel(page)
    handles = viser_server.gui._gui_input_handle_from_uuid.values()
    sliders = [each for each in handles if isinstance(each, viser.GuiSliderHandle)]
    (slider,) = (each for each in sliders if "T_s" in each.label)
    for path, value, end in (
        ("horizon", 5, longest),
        ("M_bar_scale", 0.5, 5.0 if name == "planar3-hold" else 1.0),
        ("controller", "osf", 5.0),
        ("horizon", 6, longest),
    ):
        bindings._write(scene.settings.changed(path, value))
        assert slider.max == end


@pytest.mark.parametrize("path", ["solver", "R_on", "limits.position"])
def test_menus_offer_every_word_a_setting_may_hold(
    viser_server: viser.ViserServer, path: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A state code may set any of these values. A menu cannot be created if the present value is not among
    its options."""
    # CasADi is an optional package
    monkeypatch.setattr("himpc.formulation.settings.is_installed", lambda _: True)
    scene, bindings = torque_scene("planar3-hold"), Bindings(lambda _: None, viser_server.get_event_loop())
    words = scene.settings.setting(path).form.words
    assert len(words) > 1
    for word in words:
        viser_server.gui.reset()
        changed = scene.settings.changed(path, word)
        ControllerPanel(MagicMock(gui=viser_server.gui, bindings=bindings, settings=changed))
        handles = viser_server.gui._gui_input_handle_from_uuid.values()
        menus = [each for each in handles if isinstance(each, viser.GuiDropdownHandle)]
        assert any(menu.options == words and menu.value == word for menu in menus)


@pytest.mark.parametrize("name", ["planar3-hold", "ridgeback-ur10-square"])
def test_a_setting_that_names_a_group_has_a_control(name: str) -> None:
    """A setting is added to the page by the name of a folder, which must be one of the page's folders."""
    scene, bound = load_scene(name), MagicMock()
    settings = scene.settings
    page = MagicMock(bindings=bound, settings=settings, robot=scene.robot)
    if isinstance(settings, VelocitySettings):
        HtmpcPanel(page)
        add_servo_plant(page)
    else:
        assert isinstance(settings, TorqueSettings)
        ControllerPanel(page)
        HorizonPanel(page)
        add_plant(page)
    paths = {call.args[2](1).path for call in bound.bind.call_args_list}
    assert {each.path for each in settings.table().values() if each.shown.group} <= paths


def test_a_control_that_goes_before_it_is_written_is_no_news() -> None:
    class Gone:
        """A control that was removed."""

        def __init__(self) -> None:
            object.__setattr__(self, "value", 1)

        def on_update(self, back: Any) -> Any:
            return back

        def __setattr__(self, name: str, value: object) -> None:
            raise RuntimeError(f"Cannot assign to {name!r} on a removed GuiSliderHandle.")

    loop, heard = asyncio.new_event_loop(), list[Any]()
    loop.set_exception_handler(lambda _, context: heard.append(context))
    bindings: Bindings[int] = Bindings(lambda _: None, loop)
    gone: Any = Gone()
    bindings.bind(gone, lambda settings: settings, lambda _: None)  # pyright: ignore[reportArgumentType]
    bindings.refresh(2)
    loop.call_soon(loop.stop)
    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        elsewhere.submit(loop.run_forever).result()
    loop.close()
    assert heard == []


def test_one_click_on_a_number_changes_its_second_digit() -> None:
    assert [_tenth(value) for value in (0.04, 0.5, 30.0)] == pytest.approx([0.001, 0.01, 0.1])
