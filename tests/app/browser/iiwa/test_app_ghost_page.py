"""A ghost, looking back and downloading a file, in a real browser."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from playwright.sync_api import Page, expect

from app.link.messages import Post
from app.web.server import PageServer
from browsing.browser_actions import eventually, is_drawn, key, pick, position, press, tab
from lessons.events import MoveTarget


def test_a_ghost_a_look_back_and_a_file(page: Page, server: PageServer) -> None:
    learner = server.sessions.learners[0]
    tab(page, "More")
    tab(page, "Compare")
    press(page, "Start the ghost")
    expect(page.get_by_text("Choose another controller or a setting")).to_be_attached()
    pick(page, "Difference 1", "M̄ scale")
    expect(page.get_by_role("textbox", name="its value")).to_have_value("4")  # the choice has arrived
    press(page, "Start the ghost")

    assert eventually(page, lambda: learner.ghost is not None and learner.ghost.status is not None)
    ghost = learner.ghost
    assert ghost is not None and ghost.own == ("M_bar_scale=4",)
    assert eventually(page, lambda: is_drawn(page, "/ghost/1"))
    expect(page.get_by_text("position [mm], ghost")).to_be_visible()
    expect(page.get_by_text("99 % below")).to_be_visible()

    # Both robots follow the target to the side; then the simulation pauses, and the view returns to the time
    # before.
    assert learner.status is not None
    x, y, z = learner.status.targets["position"]
    learner.send(Post(MoveTarget("position", (float(x), float(y) + 0.08, float(z)))))
    assert eventually(page, lambda: abs(position(page, "/actual")[1]) > 0.04)
    assert eventually(page, lambda: learner.status is not None and learner.status.t > 1.5)
    key(page, "Space")
    assert eventually(page, lambda: learner.status is not None and not learner.status.running)
    expect(page.get_by_text("Look back [s]")).to_be_visible()
    poses = learner.read(lambda recording: recording.block.poses())
    assert poses is not None

    def shows_now() -> bool:
        return bool(np.allclose(position(page, "/actual"), poses[-1, :3], atol=1e-4))

    assert eventually(page, shows_now)
    for _ in range(20):
        key(page, "Shift+J")
    expect(page.get_by_text("before the pause")).to_be_visible()
    assert eventually(page, lambda: not shows_now())
    assert eventually(page, lambda: not is_drawn(page, "/target") and is_drawn(page, "/target_then"))
    press(page, "Back to now")
    assert eventually(page, shows_now)

    tab(page, "More")
    tab(page, "Export")
    with page.expect_download() as download:
        press(page, "Rows as .csv")
    with open(download.value.path(), newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) > 100 and float(lines[-1]["t"]) > 1.5
    assert download.value.suggested_filename == "iiwa14-hold-himpc.csv"
    with page.expect_download() as download:
        press(page, "Script as .py")
    assert download.value.suggested_filename == "iiwa14-hold.py"
    compile(Path(download.value.path()).read_text(), "iiwa14-hold.py", "exec")

    tab(page, "More")
    tab(page, "Compare")
    press(page, "Remove the ghost")
    assert eventually(page, lambda: learner.ghost is None and not is_drawn(page, "/ghost"))
    expect(page.get_by_text("position [mm], ghost")).to_have_count(0)
