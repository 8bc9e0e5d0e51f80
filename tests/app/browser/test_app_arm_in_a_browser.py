"""`himpc-lab arm --page` is run once, in a real browser."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

from browsing.browser_actions import eventually, is_drawn, open_page, position, press, set_number, unfold
from tests.commands.exported import needed

ROOT = Path(__file__).parents[3]
WORDS = "arm panda-hold --robot simulated --set plant.friction=0.2 --page --no-browser --port 0"


@pytest.fixture
def program() -> Iterator[subprocess.Popen[str]]:
    needed("cc")
    command = [sys.executable, "-m", "tests.app.arm_program", *WORDS.split()]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as made:
        yield made
        made.kill()


def said(program: subprocess.Popen[str], words: str) -> str:
    """Returns the next line of the program that contains the words."""
    assert program.stdout is not None
    return next(line for line in program.stdout if words in line)


def test_an_arm_and_its_simulation_on_a_page(browser: Browser, program: subprocess.Popen[str]) -> None:
    """*Run* starts the control of the arm. The ghost is drawn, and both robots have errors. A moved target
    moves both. The status line shows the missed periods. Only the leaks of the simulation are drawn. When the
    page is closed, the arm is stopped gently and the program ends."""
    page = open_page(browser, said(program, "ready at").split()[-1])
    expect(page.get_by_text("at rest: Run starts the control")).to_be_visible()
    expect(page.get_by_text("Start lesson 1")).to_have_count(0)
    press(page, "Run")
    expect(page.get_by_text("ARM RUNNING")).to_be_visible()
    expect(page.get_by_text("periods missed")).to_be_visible()
    assert eventually(page, lambda: is_drawn(page, "/ghost/1"))
    expect(page.get_by_text("position [mm], ghost")).to_be_visible()
    unfold(page, "Move a target by keys")
    set_number(page, "Target y [m]", 0.08)

    def moved() -> bool:
        tip, ghost = position(page, "/actual"), position(page, "/ghost/7")  # the hand points down
        return bool(np.allclose([tip[1], ghost[1]], 0.08, atol=2e-3))

    assert eventually(page, moved)
    leaks = page.get_by_text("Leak into higher levels")
    leaks.scroll_into_view_if_needed()
    expect(page.get_by_text("priority (own model), ghost")).to_be_visible()
    expect(page.get_by_text("priority (own model)", exact=True)).to_have_count(0)
    page.wait_for_timeout(3000)  # longer than the time after which an empty chart is explained
    expect(page.get_by_text("No tick has run yet").locator("visible=true")).to_have_count(0)
    page.context.close()
    assert said(program, "ended: ") == "ended: the page was closed; it came to rest under control\n"
    assert program.wait(60.0) == 0
