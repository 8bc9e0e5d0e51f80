"""The "Inside" panel in a real browser: the picture of a tick, its numbers, and its cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from served import served

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import InsideRequest, Play, Post
from app.panels.inside.matrix import EIGENVALUES as SPECTRUM
from app.panels.inside.matrix import TITLE as HESSIAN
from app.panels.inside.plane import TITLE as PLANE
from app.web.server import PageServer
from browsing.browser_actions import drag_target, eventually, often, open_page, press, set_number, tab, unfold
from browsing.scene_switch import show_scene
from lessons.events import Set
from lessons.geometry.plane import Plane
from lessons.scenes.run_spec import RunSpec

INSIDE = pytest.mark.nightly(
    *(f"app/{part}" for part in ("adapter", "html", "link", "page", "panels", "worker")),
    *("browsing/", "lessons/geometry", "lessons/scenes/planar"),
)
ARM = 0.08
"""Distance from the arm at which the gizmo of this small arm is grasped, m."""


@pytest.fixture(scope="module")
def drawing() -> Iterator[PageServer]:
    with served("planar3-plane", grace=2.0) as running:
        yield running


@pytest.fixture(scope="module")
def shared(browser: Browser, drawing: PageServer) -> Iterator[Page]:
    opened = open_page(browser, drawing.link, 1300, 700)
    yield opened
    opened.context.close()


@pytest.fixture
def sheet(shared: Page, drawing: PageServer) -> Page:
    """Returns the page in its initial state, after the picture of the new run was drawn. The picture of the
    run before is still there when the new one begins."""
    learner = learner_of(drawing)
    assert eventually(shared, lambda: learner.status is not None)
    before = 0 if learner.status is None else learner.status.resets
    press(shared, "Reset all")
    tab(shared, "Inside")

    def shown() -> bool:
        status = learner.status
        inside = None if status is None or status.resets == before else status.inside
        return inside is not None and inside.plane is not None and point(shared, "optimum-1") is not None

    assert eventually(shared, shown)
    return shared


def learner_of(server: PageServer) -> SimulationClient:
    return server.sessions.learners[0]


FIND = """([title, name]) => { const all = [...document.querySelectorAll("[data-chart]")];
             const it = all.find((e) => e.dataset.chart === title)?.querySelector("." + name);
             return it ? it.dataset.at : null; }"""


def point(page: Page, name: str) -> np.ndarray | None:
    """Returns the coordinates of a point of the picture, N·m, to ten digits; None if it is not drawn."""
    found = page.evaluate(FIND, [PLANE, name])
    return None if found is None else np.array([float(value) for value in str(found).split(",")])


def plane(server: PageServer) -> Plane:
    status = learner_of(server).status
    assert status is not None and status.inside is not None and status.inside.plane is not None
    return status.inside.plane


def stand_still(page: Page, server: PageServer) -> None:
    """Pauses, and waits until the picture shows the last tick."""
    learner = learner_of(server)
    learner.send(Play(False))
    assert eventually(page, lambda: learner.status is not None and not learner.status.running)
    assert eventually(page, lambda: agrees(page, server))


def agrees(page: Page, server: PageServer) -> bool:
    """Returns whether the picture shows both optima at the solver's points."""
    found = [point(page, f"optimum-{place}") for place in (1, 2)]
    levels = plane(server).levels
    return all(
        at is not None and float(np.abs(at - level.solved).max()) < 1e-6
        for at, level in zip(found, levels[:2], strict=True)
    )


@contextmanager
def watched(page: Page, names: Sequence[str]) -> Iterator[None]:
    """While the context is open, the page stores the coordinates of the points ten times a second."""
    page.evaluate(
        f"""([title, names]) => {{
             const find = {FIND};
             window.seen = Object.fromEntries(names.map((name) => [name, []]));
             window.looking = setInterval(() => {{
               for (const name of names) {{
                 const at = find([title, name]);
                 if (at) window.seen[name].push(at.split(",").map(Number));
               }}
             }}, 100);
           }}""",
        [PLANE, list(names)],
    )
    with often(page):
        yield
    page.evaluate("() => clearInterval(window.looking)")


def test_dragging_the_target_moves_both_optima(sheet: Page, drawing: PageServer) -> None:
    """The points are recorded from a time before the drag, because in a slow browser everything is at rest
    again when the drag ends."""
    names = ("optimum-1", "optimum-2")

    def moved() -> bool:
        paths = [np.array(sheet.evaluate("(name) => window.seen[name]", name)) for name in names]
        return all(len(path) > 1 and float(np.ptp(path, axis=0).max()) > 1e-3 for path in paths)

    with watched(sheet, names):
        drag_target(sheet, axis=0, along=0.12, arm=ARM)
        assert eventually(sheet, moved)
    # At rest, level 2 has an optimum that differs from its optimum alone; the picture agrees with the solver.
    assert eventually(sheet, lambda: point(sheet, "wish-2") is not None)
    stand_still(sheet, drawing)
    assert plane(drawing).apart < 1e-6
    expect(sheet.get_by_text("Geometry and solver agree to")).to_be_visible()


@INSIDE
def test_nobody_asks_while_nobody_looks(sheet: Page, drawing: PageServer) -> None:
    learner = learner_of(drawing)
    tab(sheet, "Errors")
    assert eventually(sheet, lambda: learner.status is not None and learner.status.inside is None)
    tab(sheet, "Inside")
    assert eventually(sheet, lambda: learner.status is not None and learner.status.inside is not None)
    status = learner.status
    inside = None if status is None else status.inside
    assert inside is not None and inside.matrix is None and inside.spectrum is None


@INSIDE
def test_the_hessian_opens_on_demand(sheet: Page, drawing: PageServer) -> None:
    unfold(sheet, "The Hessian")
    sheet.locator(f'[data-chart="{HESSIAN}"]').scroll_into_view_if_needed()
    assert eventually(sheet, lambda: sheet.get_by_text("H = GᵀQG + R of level").is_visible())
    learner = learner_of(drawing)
    assert eventually(sheet, lambda: learner.status is not None and learner.status.inside is not None
                      and learner.status.inside.matrix is not None)  # fmt: skip
    expect(sheet.locator(f'[data-chart="{HESSIAN}"]').get_by_text("joint by joint")).to_be_visible()
    sheet.get_by_text("The Hessian", exact=True).click()


@INSIDE
def test_eigenvalues_move_with_M_bar(sheet: Page, drawing: PageServer) -> None:
    def farthest() -> float:
        found = sheet.evaluate(
            """(title) => [...document.querySelectorAll("[data-chart]")]
                 .filter((e) => e.dataset.chart === title)
                 .flatMap((e) => [...e.querySelectorAll(".eigenvalue")].map((c) => Number(c.dataset.at)))""",
            SPECTRUM,
        )
        return min(found, default=float("nan"))

    tab(sheet, "Tasks")
    unfold(sheet, "Why M̄ matters")
    sheet.locator(f'[data-chart="{SPECTRUM}"]').scroll_into_view_if_needed()
    assert eventually(sheet, lambda: farthest() == farthest())
    before = farthest()
    set_number(sheet, "M̄ scale", 2.0)
    assert eventually(sheet, lambda: farthest() < before - 0.1)
    tab(sheet, "Learn")


@INSIDE
def test_one_knot_is_a_click_away(shared: Page, drawing: PageServer) -> None:
    """This test leaves another scene on the page, so it is the last one."""
    page, learner = shared, learner_of(drawing)
    show_scene(page, learner, SceneChoice(RunSpec("planar3-hold")))
    tab(page, "Inside")
    expect(page.get_by_text("Later knots are held")).to_be_visible()
    press(page, "Look one knot ahead (N = 1)")
    assert eventually(page, lambda: learner.settings is not None and learner.settings.horizon == 1)
    expect(page.get_by_text("Later knots are held")).to_be_hidden()
    learner.send(Post(Set("controller", "osf")))
    expect(page.get_by_text("osf does not solve such QPs")).to_be_visible()
    learner.send(InsideRequest(plane=(7, 9)))  # joints that the robot does not have
    assert eventually(page, lambda: learner.failure is None and learner.status is not None)
