"""In the live figures of the site a browser simulates what the lab computes. The site opens from a disk."""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from browsing.browser_actions import SLOW, eventually
from browsing.firefox import Tab, firefox, missing
from docs.figures import front
from docs.figures.model import model_of, model_text
from docs.figures.pack import Pack
from docs.figures.robot import mechanics
from docs.figures.scene import scene_data
from docs.figures.steps import judged, robot_of, scene_of_step, why_not
from docs.pages import lessons
from lessons.course import COURSE, load_lesson
from lessons.events import MoveLevel, MoveTarget, Push, Set
from lessons.replay.state import State, decode, encode
from lessons.scenes.catalog import as_torque_scene, load_scene
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.teaching.lesson import Lesson, Step

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning"),
    pytest.mark.skipif(
        front.missing() is not None and os.environ.get("CI") != "true", reason=str(front.missing())
    ),
]
SECONDS = 2.0
UNSTABLE = "no-model-needed/4"
"""Errors grow from period to period in this step, as its claim says; so does a difference in the last
digit."""
CROWDED = "a-blind-arm/4"
"""In this step up to half of all rows are active, of joints and of distances; there rounding differs by up to
2e-5 N·m."""
_LOAD = "(async () => { await (window.engine = new HIMPC.Engine()).load(); })()"
_MOVED = """new Promise((done) => {
  const look = () => (HIMPC.shown?.frame?.t > 0.1 ? drawn() : setTimeout(look, 50));
  const drawn = () => requestAnimationFrame(() => setTimeout(done));
  look();
})"""
_REPLAY = """async ([pack, robot, step, ticks]) => {
  const { told: given } = await HIMPC.unpacked(HIMPC.packed(`robot/${robot}`));
  const scenes = await HIMPC.unpacked(HIMPC.packed(pack));
  await engine.call("open", { scenes, robot: given, step, assignments: [] });
  const { tau, claims, prediction } = await engine.call("replay", ticks);
  const bytes = new Uint8Array(tau.buffer);
  let text = "";
  for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
  return { tau: btoa(text), claims: claims.map(String), prediction: String(prediction) };
}"""


@pytest.fixture(scope="module")
def everything(live_site: Path) -> Iterator[str]:
    """The address of a page on the disk that contains all scripts of the live figures."""
    scripts = "".join(
        f'<script src="live/{path.name}"></script>' for path in sorted((live_site / "live").glob("*.js"))
    )
    page = live_site / "everything.html"
    page.write_text(f"<!doctype html><meta charset=utf-8><body>{scripts}</body>", encoding="utf-8")
    yield page.as_uri()
    page.unlink()


@pytest.fixture(scope="module")
def simulated(everything: str, browser: Browser) -> Iterator[Page]:
    """The page `everything` in Chromium, with the simulating thread loaded."""
    opened = browser.new_page()
    opened.set_default_timeout(SLOW)
    opened.goto(everything)
    opened.evaluate(_LOAD)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def in_firefox() -> Iterator[Tab]:
    if (reason := missing()) is not None:
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    with firefox() as tab:
        yield tab


@pytest.fixture(scope="module")
def simulated_in_firefox(everything: str, in_firefox: Tab) -> Tab:
    in_firefox.goto(everything)
    in_firefox.evaluate(_LOAD)
    return in_firefox


def torques(scene: TorqueScene, seconds: float) -> np.ndarray:
    """Returns the torques that Python computes in closed loop, (ticks, n) N·m, until the robot touches
    something: the page has an older MuJoCo with other contact forces, and later torques would differ."""
    session = TorqueSession(scene, 0)
    demand, touch = (session.layout.fields[name] for name in ("tau_demand", "contact_force"))
    found: list[np.ndarray] = []
    for _ in range(round(seconds / scene.settings.T_s)):
        row = session.tick()
        found.append(row[demand].copy())
        if np.any(row[touch] > 0.0):
            break
    return np.array(found)


def parts_of(name: str) -> tuple[Lesson, Step]:
    lesson = load_lesson(name.split("/")[0])
    return lesson, lesson.steps[int(name.split("/")[1]) - 1]


@cache
def live_steps(lesson: str) -> list[str]:
    """Returns the steps of a lesson that have a live figure, as `LESSON/STEP`."""
    places = range(len(load_lesson(lesson).steps))
    return [f"{lesson}/{place + 1}" for place in places if why_not(lesson, place) is None]


@cache
def wanted(name: str) -> np.ndarray:
    """The torques of two seconds of a live figure, `SCENE` or `LESSON/STEP`, computed once for both
    browsers."""
    if "/" not in name:
        return torques(as_torque_scene(load_scene(name), "a test's"), SECONDS)
    lesson, step = parts_of(name)
    scene = as_torque_scene(scene_of_step(lesson, step), "a test's")
    return torques(scene, min(SECONDS, step.duration) if name != UNSTABLE else 0.05)


def replayed(page: Page | Tab, pack: str, robot: str, step: str | None, ticks: int) -> dict[str, Any]:
    found: dict[str, Any] = page.evaluate(f"({_REPLAY})({json.dumps([pack, robot, step, ticks])})")
    tau = np.frombuffer(base64.b64decode(found["tau"])).reshape(ticks, -1)
    return {**found, "tau": tau, "claims": [float(each.replace("NaN", "nan")) for each in found["claims"]]}


def figure(page: Page | Tab, name: str, ticks: int) -> dict[str, Any]:
    """Returns what a browser computes for a live figure, `SCENE` or `LESSON/STEP`."""
    if "/" not in name:
        scene = as_torque_scene(load_scene(name), "a test's")
        return replayed(page, f"scene/{name}", scene.robot.name, None, ticks)
    lesson, step = parts_of(name)
    return replayed(page, f"lesson/{lesson.name}", robot_of(lesson, step), name.split("/")[1], ticks)


FIGURES = pytest.mark.nightly(
    "docs/browser",
    "docs/build.py",
    "docs/figures",
    "docs/pages/lessons.py",
    "himpc/compilation",
    "himpc/export",
    "himpc/tick/kernel",
    "lessons/course",
    "lessons/scenes",
    "lessons/session",
    "robots/plant.py",
)
"""The mark of all tests of the built figures; compiling their kernel for a browser takes minutes. At every
push `test_commands_export.py` replays a controller in WebAssembly, and the tests below without this mark
compare the model and check the program."""


@FIGURES
@pytest.mark.parametrize("name", front.TRIED)
def test_the_page_computes_what_the_lab_computes(simulated: Page, name: str) -> None:
    """The torques of the scenes of Try it equal Python's in closed loop, also while the robot is pushed."""
    found = figure(simulated, name, len(wanted(name)))
    assert np.abs(found["tau"] - wanted(name)).max() < 1e-8


@FIGURES
@pytest.mark.parametrize("lesson_name", COURSE)
def test_a_live_step_is_the_step_of_the_lesson(simulated: Page, lesson_name: str) -> None:
    """The torques of two seconds equal Python's, and the claims that a browser judges hold in the step."""
    for name in live_steps(lesson_name):
        lesson, step = parts_of(name)
        scene = scene_of_step(lesson, step)
        found = figure(simulated, name, round(step.duration / scene.settings.T_s))
        most = 1e-4 if name == CROWDED else 1e-8
        assert np.abs(found["tau"][: len(wanted(name))] - wanted(name)).max() < most, name
        with_ghost = step.ghost is not None and not re.search(
            "controller=(hqp|osf)", " ".join(step.ghost.set)
        )
        seen = 0
        for claim, value in zip(step.claims, found["claims"], strict=True):
            if judged(claim.measure, with_ghost):
                assert claim.holds(value), (name, claim.text)
                seen += 1
            else:
                assert np.isnan(value), (name, claim.text)
        assert seen, name


FIREFOX = pytest.mark.nightly("docs/browser", "himpc/compilation", "himpc/export")


@FIREFOX
@pytest.mark.parametrize("of", [*front.TRIED, *COURSE])
def test_firefox_computes_what_the_lab_computes(simulated_in_firefox: Tab, of: str) -> None:
    """The torques of two seconds of every live figure equal Python's."""
    for name in [of] if of in front.TRIED else live_steps(of):
        found = figure(simulated_in_firefox, name, len(wanted(name)))
        most = 1e-4 if name == CROWDED else 1e-8
        assert np.abs(found["tau"] - wanted(name)).max() < most, name


@FIREFOX
def test_firefox_draws_the_robot(live_site: Path, in_firefox: Tab) -> None:
    """The page simulates in Firefox and draws the ball of the first level, in orange, at its position."""
    in_firefox.goto((live_site / "try.html").as_uri() + "#planar3-hold")
    in_firefox.evaluate(_MOVED)
    picture = np.asarray(Image.open(BytesIO(in_firefox.screenshot())).convert("RGB"), float)
    x, y = in_firefox.evaluate("HIMPC.shown.pixel('position')")
    red, green, blue = picture[round(y), round(x)]
    assert red > green + 30 > blue + 60


@pytest.mark.parametrize("name", ["iiwa14-table", "panda-hold", "planar3-hold"])
def test_the_model_in_the_browser_is_that_of_the_lab(name: str) -> None:
    """When its placeholders have the nominal numbers, the text that the page completes gives the model of the
    lab bit by bit: bodies, geometries, contacts, stops and objects."""
    scene = as_torque_scene(load_scene(name), "a test's")
    told = mechanics(scene.robot)
    text = model_text(scene.robot, scene.world)
    alike = {"stops": "true", "contacts": "enable", "gravity": told["gravity"]}

    def number(place: re.Match[str]) -> str:
        joint = int(place[2]) - 1
        own = told["bodies"][joint] if joint >= 0 else {}
        found = {**dict.fromkeys(("armature", "damping", "friction"), 0.0), **own, **alike}[place[1]]
        return found if isinstance(found, str) else " ".join(map(repr, np.ravel(found).tolist()))

    model = mujoco.MjModel.from_xml_string(re.sub(r"@(\w+) (\d+)@", number, text))
    wanted, seen = model_of(scene.robot, scene.world), 0
    for field in ("body", "jnt", "dof", "geom", "mesh_vert", "exclude", "actuator"):
        for each in dir(wanted):
            if each.startswith(field) and isinstance(value := getattr(wanted, each), np.ndarray):
                assert np.array_equal(getattr(model, each), value), each
                seen += 1
    assert seen > 80 and model.opt.integrator == wanted.opt.integrator
    assert np.array_equal(model.opt.gravity, wanted.opt.gravity)


def test_few_claims_are_left_to_the_lab() -> None:
    """One claim of the live steps needs the plant's M at every level, and one the plant's distances; the page
    computes neither."""
    steps = [name for lesson in COURSE for name in live_steps(lesson)]
    names = [
        claim.measure.signal.name
        for name in steps
        for claim in load_lesson(name.split("/")[0]).steps[int(name.split("/")[1]) - 1].claims
        if not judged(claim.measure, True)
    ]
    assert sorted(names) == ["distance", "dynamic_leak"] and len(steps) >= 45


@FIGURES
def test_plots_and_their_legends_are_in_the_window(live_site: Path, browser: Browser) -> None:
    """In a small window the cards scroll, and a line shows this. The labels of the axis of the errors differ
    while all errors are zero. Joints have other colours than levels."""
    page = browser.new_page(viewport={"width": 1100, "height": 750})
    page.set_default_timeout(SLOW)
    page.goto((live_site / "try.html").as_uri() + "#iiwa14-hold")
    page.wait_for_function("() => HIMPC.shown?.frame?.t > 0.1")
    bottoms = "[...document.querySelectorAll('.u-legend')].map((each) => each.getBoundingClientRect().bottom)"
    assert max(page.evaluate(bottoms)) <= 750
    assert page.locator(".hl-side[data-below]").count() == 1
    page.evaluate("(() => { const side = document.querySelector('.hl-side'); side.scrollTop = 1e4; })()")
    page.wait_for_function("() => document.querySelector('.hl-side[data-above]:not([data-below])')")
    marks = "[...document.querySelectorAll('.hl-mark')].map((each) => getComputedStyle(each).backgroundColor)"
    lines = "[...document.querySelectorAll('.hl-plots figure:last-child .u-marker')]"
    joints = page.evaluate(f"{lines}.map((each) => getComputedStyle(each).borderTopColor)")
    assert len(joints) > 7 and not set(joints) & set(page.evaluate(marks))
    page.close()


@FIGURES
@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
def test_try_it(live_site: Path, browser: Browser, width: int, height: int) -> None:
    """The page is opened from a file. The robot is pushed, its target is dragged with mouse and keys, levels
    change places, and the page sends no request to a server."""
    asked: list[str] = []
    page = browser.new_page(viewport={"width": width, "height": height}, has_touch=width < 500)
    page.set_default_timeout(SLOW)
    page.on("request", lambda request: asked.append(request.url))
    page.goto((live_site / "try.html").as_uri() + "#planar3-hold")
    page.wait_for_function("() => HIMPC.shown?.frame?.t > 0.1")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.get_by_role("button", name="Push").click()
    page.wait_for_function("() => HIMPC.shown.frame.curves[1] > 1e-3")
    page.locator(".hl-view canvas").scroll_into_view_if_needed()
    start = page.evaluate("HIMPC.shown.frame.targets[0].value")
    x, y = page.evaluate("HIMPC.shown.pixel('position')")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 25, y - 20, steps=4)
    page.mouse.up()
    target = "HIMPC.shown.frame.targets[0].value"
    moved = f"([x, y]) => Math.hypot({target}[0] - x, {target}[1] - y)"
    page.wait_for_function(f"(start) => ({moved})(start) > 0.02", arg=start[:2])
    page.locator(".hl-view canvas").focus()
    here = page.evaluate("HIMPC.shown.frame.targets[0].value")
    page.keyboard.press("ArrowLeft")
    page.wait_for_function(f"(start) => ({moved})(start) > 0.01", arg=here[:2])
    up = page.get_by_role("button", name="orientation up")
    up.focus()
    page.keyboard.press("Enter")
    page.wait_for_function("() => HIMPC.shown.frame.order[0] === 'orientation'")
    page.get_by_label("N", exact=True).select_option("10")
    page.wait_for_function("() => HIMPC.shown.frame.horizon === 10 && !HIMPC.shown.frame.lost")
    page.get_by_role("button", name="Pause").click()
    page.wait_for_function("() => !HIMPC.shown.frame.running")
    page.close()
    assert asked and all(url.startswith(("file:", "data:", "blob:")) for url in asked)


@FIGURES
def test_a_code_goes_both_ways(live_site: Path, browser: Browser) -> None:
    """The page opens a code of the lab with its settings, and the lab reads a code of the page."""
    told = (
        "M_bar_scale=2",
        "horizon=10",
        "levels.posture.enabled=false",
        "order=orientation,position,posture",
    )
    page = browser.new_page(reduced_motion="reduce")
    page.set_default_timeout(SLOW)
    page.goto((live_site / "try.html").as_uri() + "#" + encode(State(RunSpec("panda-hold", set=told))))
    page.wait_for_function("() => HIMPC.shown?.frame")
    assert page.evaluate("HIMPC.shown.frame.order.join()") == "orientation,position,posture"
    assert page.evaluate("[HIMPC.shown.frame.horizon, HIMPC.shown.frame.running]") == [10, False]
    assert not page.get_by_label("posture", exact=True).is_checked()
    page.get_by_label("N", exact=True).select_option("5")
    assert eventually(
        page, lambda: "horizon=5" in decode(page.get_by_label("State code").input_value()).run.set
    )
    state = decode(page.get_by_label("State code").input_value())
    assert state.run.scene == "panda-hold" and set(state.run.set) == {*told, "horizon=5"} - {"horizon=10"}
    wanted, found = RunSpec("panda-hold", set=told).but("horizon=5").prepared(), state.run.prepared()
    assert found.settings == wanted.settings
    page.close()


@FIGURES
def test_a_step_in_a_page(live_site: Path, browser: Browser) -> None:
    """A step is predicted, run and judged in its page. The lab opens its code, and a link opens the step."""
    page = browser.new_page(reduced_motion="reduce")
    page.set_default_timeout(SLOW)
    page.goto((live_site / "lessons" / "inside-the-qp.html").as_uri())
    page.locator("button[data-live]").first.click()
    figure = page.locator("figure.live.open")
    figure.get_by_role("radio").first.check()
    assert page.evaluate("HIMPC.shown.frame?.running ?? false") is False
    figure.get_by_role("button", name="Run this step").click()
    page.wait_for_function("() => document.querySelectorAll('[data-holds=true]').length === 2")
    assert re.search(r"\(✓ measured: .*\)$", figure.locator(".hl-answer").inner_text())
    state = decode(figure.get_by_label("State code").input_value())
    lesson = load_lesson("inside-the-qp")
    assert (state.lesson, state.step) == ("inside-the-qp", 1)
    assert state.run.prepared().settings == lesson.run_of(lesson.steps[0]).prepared().settings
    third = lesson.run_of(lesson.steps[2]).but("levels.pose.enabled=false")
    code = encode(State(replace(third, events=None, duration=None), lesson.name, 3))
    page.goto(page.url.split("#")[0] + "#" + code)
    page.reload()
    page.wait_for_function("() => HIMPC?.shown?.frame")
    assert not page.get_by_label("pose", exact=True).is_checked()
    page.close()


@FIGURES
def test_what_is_loaded_first_is_small(live_site: Path) -> None:
    """Page, program, MuJoCo, kernel, robot and scene have less than 5 MB; scripts hold compressed data."""
    names = ("live", "mujoco", "kernel", "iiwa14-hold", "robot-iiwa14")
    files = [live_site / "try.html", *(live_site / "live" / f"{name}.js" for name in names)]
    assert sum(path.stat().st_size for path in files) < 5e6
    import gzip

    assert sum(len(gzip.compress(path.read_bytes())) for path in files) < 4e6


def test_the_program_is_small_and_typed_and_its_packages_are_pinned() -> None:
    """The program has at most 1,500 lines."""
    told = json.loads((front.PROGRAM / "package.json").read_text())
    files = [front.PROGRAM / "build.mjs", *(front.PROGRAM / "src").iterdir()]
    assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files) <= 1500
    assert all(
        re.fullmatch(r"[\d.]+", each)
        for kind in ("dependencies", "devDependencies")
        for each in told[kind].values()
    )
    lock = json.loads((front.PROGRAM / "package-lock.json").read_text())
    root, *packages = lock["packages"].values()
    assert {kind: root[kind] for kind in ("dependencies", "devDependencies")} == {
        kind: told[kind] for kind in ("dependencies", "devDependencies")
    }
    assert packages and all({"version", "integrity"} <= set(each) for each in packages)
    assert not [each for each in packages if "resolved" in each]
    checked = subprocess.run(
        ("npm", "run", "--silent", "check"), cwd=front.PROGRAM, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stdout


def test_without_node_the_site_has_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without Node, the build names what is missing, and the pages have curves but no live figures."""
    monkeypatch.setattr("docs.figures.front.shutil.which", lambda name: None)
    assert "need node" in str(front.missing())
    pages = lessons.pages(front.ROOT, live=False)
    assert not any("data-live" in text for text in pages.values())
    assert any('class="curves"' in text for text in pages.values())


CHANGES = (
    (0.1, MoveTarget("position", (0.5, 0.2, 0.5))),
    (0.3, Set("M_bar_scale", 1.5)),
    (0.4, MoveLevel("posture", 0)),
    (0.6, Set("levels.orientation.enabled", False)),
    (0.7, Set("plant.payload_kg", 2.0)),
    (0.8, Set("tasks.position.K_p", 60.0)),
    (0.9, Set("levels.orientation.enabled", True)),
    (1.0, MoveLevel("position", 0)),
    (1.1, Set("levels.position.Q", 50.0)),
    (1.2, Set("levels.posture.R", 40.0)),
    (1.3, Push("link_4", (20.0, 0.0, 10.0))),
    (1.4, Set("limits.torque_scale", 0.6)),
    (1.5, Set("limits.velocity_scale", 0.9)),
    (1.6, Set("horizon", 10)),
    (1.7, MoveTarget("position", (0.55, -0.1, 0.45))),
    (1.8, Set("horizon", 2)),
    (2.0, Set("plant.friction", 0.5)),
)


@FIGURES
def test_what_is_changed_while_the_robot_moves_acts_as_in_the_lab(simulated: Page) -> None:
    """Targets, order, levels, N, M̄, gains, weights, limits, payload, friction and pushes are changed."""
    scene = RunSpec("iiwa14-hold").prepared()
    assert isinstance(scene, TorqueScene)
    changed, pack = replace(scene, events=CHANGES), Pack()
    script = pack.script("scene/changed", {"scene": scene_data(changed, pack, (2, 10))})
    simulated.add_script_tag(content=script)
    wanted = torques(changed, 2.2)
    found = replayed(simulated, "scene/changed", "iiwa14", None, len(wanted))
    apart = np.abs(found["tau"] - wanted).max(axis=1)
    assert apart.max() < 1e-8, f"apart by {apart.max():.1e} N·m, first at {np.argmax(apart > 1e-8)} ms"
