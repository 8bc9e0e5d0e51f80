"""A setting is shared in a real browser: as a command line, as a code and as a script."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Page, expect

from app.client.simulation_client import SimulationClient
from app.web.server import PageServer
from browsing.browser_actions import eventually, press, row, set_number, tab, write
from browsing.scene_switch import reset_all
from lessons.replay.state import decode
from lessons.settings.torque import TorqueSettings


def horizon(learner: SimulationClient) -> int:
    assert isinstance(learner.settings, TorqueSettings)
    return learner.settings.horizon


def test_a_code_brings_the_setting_back_and_a_script_repeats_the_run(page: Page, server: PageServer) -> None:
    learner = server.sessions.learners[0]
    before = horizon(learner)
    tab(page, "Tasks")
    set_number(page, "N", before + 2)
    assert eventually(page, lambda: horizon(learner) == before + 2)
    tab(page, "More")
    tab(page, "Export")
    press(page, "Write it down")
    line, code = (row(page, label).locator("textarea") for label in ("Command line", "Code"))
    expect(line).to_have_value(f"himpc-lab run iiwa14-hold --set horizon={before + 2}")
    given = code.input_value()
    assert decode(given).run.set == (f"horizon={before + 2}",)

    with page.expect_download() as download:
        press(page, "Script as .py")
    text = Path(download.value.path()).read_text()
    assert download.value.suggested_filename == "iiwa14-hold.py"
    compile(text, "iiwa14-hold.py", "exec")
    assert f"Set('horizon', {before + 2})" in text

    tab(page, "Learn")
    reset_all(page, learner)
    assert eventually(page, lambda: horizon(learner) == before)
    tab(page, "More")
    tab(page, "Export")
    write(page, "Somebody's code", given[:-3])
    press(page, "Open it")
    # Tests make notifications transparent, because they cover the scene.
    expect(page.get_by_text("copy all of it again")).to_be_attached()
    assert horizon(learner) == before
    write(page, "Somebody's code", given)
    press(page, "Open it")
    assert eventually(page, lambda: horizon(learner) == before + 2)
    assert learner.choice.run.set == (f"horizon={before + 2}",)
