"""Opens the page in a Chromium; functions find and use the controls that viser draws."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import Browser, Locator, Page

CHROMIUM_ARGS = ["--no-sandbox", "--disable-dev-shm-usage", "--enable-unsafe-swiftshader"]
SLOW = 60_000  # time limit of an action, ms, for WebGL in software on two shared cores
BETWEEN = 120  # ms between two controls: viser throttles a container to one change per 50 ms

FAULTS: list[str] = []
"""The errors that the scripts of all pages of `new_page` have raised so far."""
SCALE = 0.25
"""Pixels per CSS pixel for pages that nobody looks at."""
OFTEN, SELDOM = 80, 300
"""Time between two frames, ms: OFTEN while the mouse drags in the 3D view, otherwise SELDOM."""

_RESTING = """(() => {
  const frame = window.requestAnimationFrame.bind(window);
  window.picturesRest = REST;
  window.requestAnimationFrame = (draw) => window.setTimeout(() => frame(draw), window.picturesRest);
  window.cancelAnimationFrame = (id) => window.clearTimeout(id);
})()"""

_PLAIN = """(() => {
  const context = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, options) {
    return context.call(this, kind, kind.startsWith("webgl") ? { ...options, antialias: false } : options);
  };
  const small = document.createElement("canvas");
  [small.width, small.height] = [64, 32];
  const paint = small.getContext("2d");
  paint.fillStyle = "#aaa";
  paint.fillRect(0, 0, 64, 32);
  const sky = small.toDataURL("image/jpeg");
  const get = window.fetch.bind(window);
  window.fetch = (what, options) =>
    (what.url ?? String(what)).startsWith("data:image/jpeg") ? get(sky) : get(what, options);
})()"""

_UNDRAWN = """(() => {
  const last = ["clear", "drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"];
  for (const name of last) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...told) {
      if (!this.canvas.isConnected) draw.apply(this, told);
    };
  }
})()"""
"""Makes the calls that fill the pixels of the page's canvases do nothing. All steps before these calls are
done as usual: scene, poses, visibility, the search for the object under the mouse, triangles."""

_WCAG = """() => axe.run(document, {
  runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"], resultTypes: ["violations"] })"""

_PICTURES = """() => new Promise((done) => {
  window.setTimeout(done, 60000);
  let left = 3;
  const next = () => (left-- > 0 ? window.requestAnimationFrame(next) : done());
  next();
})"""

_PROJECT = """([name, at]) => {
  const m = window.__viserMutable, node = m.nodeRefFromName[name];
  node.updateWorldMatrix(true, false); m.camera.updateMatrixWorld(true);
  const v = m.camera.position.clone().set(at[0], at[1], at[2]);
  v.applyMatrix4(node.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x * 0.5 + 0.5) * r.width, r.top + (-v.y * 0.5 + 0.5) * r.height];
}"""


def load_axe(page: Page) -> None:
    """Loads axe-core into the page, for `violations`."""
    page.evaluate((files("axe_playwright_python") / "axe.min.js").read_text(encoding="utf-8"))


def violations(page: Page) -> list[str]:
    """Returns what axe-core finds against WCAG 2.1 A and AA."""
    found: Any = page.evaluate(_WCAG)
    return [
        f"{each['id']}: {node['html'][:150]} {node['failureSummary'][:200]}"
        for each in found["violations"]
        for node in each["nodes"]
    ]


def find_chromium() -> str | None:
    return shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def open_page(
    browser: Browser,
    url: str,
    width: int = 1300,
    height: int = 480,
    scale: float = SCALE,
    rest: int = SELDOM,
) -> Page:
    """Returns a page in a new browser profile after it is loaded and the robot is drawn; the arguments are
    those of `new_page`."""
    page = new_page(browser, width, height, scale, rest)
    # By default, viser draws at least one pixel per CSS pixel.
    load(page, url if scale >= 1 else f"{url}{'&' if urlsplit(url).query else '?'}fixedDpr={scale}")
    return page


def new_page(
    browser: Browser, width: int = 1300, height: int = 480, scale: float = SCALE, rest: int = SELDOM
) -> Page:
    """Returns an empty page in a new browser profile; drawing in it needs little processor time.

    Args:
        browser: without a graphics card, a frame takes a tenth of a second on two cores.
        width, height: size of the page in CSS pixels.
        scale: pixels per CSS pixel. Below 1, edges are not smoothed, and a plain grey sky gives the light.
            (viser's sky has a million pixels and is blurred seven times: four seconds of one core.)
            At `SCALE` or below no pixel is filled; the page then takes a third of the processor time.
        rest: time between two frames, ms. During a drag it is `OFTEN`.
    """
    page = browser.new_context(
        viewport={"width": width, "height": height}, device_scale_factor=scale
    ).new_page()
    page.set_default_timeout(SLOW)
    page.on("pageerror", lambda error: FAULTS.append(str(error)))
    page.add_init_script(_RESTING.replace("REST", str(rest)))
    if scale < 1:
        page.add_init_script(_PLAIN)
    if scale <= SCALE:
        page.add_init_script(_UNDRAWN)
    return page


def load(page: Page, url: str) -> None:
    page.goto(url, wait_until="commit")
    wait_for_scene(page)
    page.wait_for_function(
        """() => { let o = 1; for (let p = window.__viserMutable.canvas; p && p.nodeType === 1;
             p = p.parentElement) o *= parseFloat(getComputedStyle(p).opacity); return o > 0.99; }""",
        timeout=SLOW,
    )
    # The notice "Software WebGL" covers the canvas and would receive the mouse events.
    page.add_style_tag(
        content=".mantine-Notifications-root, .mantine-Notifications-root *"
        "{pointer-events:none !important;opacity:0}"
    )


def wait_for_scene(page: Page, node: str = "/actual") -> None:
    page.wait_for_function(
        """(node) => { const m = window.__viserMutable, t = window.__viserTestpoints;
             return m && t && m.nodeRefFromName[node] && t.rendererInfo.render.triangles > 0; }""",
        arg=node,
        timeout=SLOW,
    )


def row(page: Page, label: str) -> Locator:
    """Returns the row that contains a control's label and inputs."""
    return page.locator(
        f'xpath=(//label[@for and normalize-space(.)="{label}"]'
        '/ancestor::div[contains(@class,"mantine-Flex-root")])[1]'
    )


def set_number(page: Page, label: str, value: object) -> None:
    """Types a value into the number box of a slider or a number input."""
    box = row(page, label).locator("input[type=text], input[inputmode]").last
    box.fill(str(value))
    box.press("Enter")
    page.wait_for_timeout(BETWEEN)


def number(page: Page, label: str) -> float:
    return float(row(page, label).locator("input[type=text], input[inputmode]").last.input_value())


def write(page: Page, label: str, text: str) -> None:
    box = row(page, label).locator("input, textarea").first
    box.fill(text)
    box.press("Tab")
    page.wait_for_timeout(BETWEEN)


def pick(page: Page, label: str, option: str) -> None:
    """Chooses an option of a menu."""
    row(page, label).locator("input").first.click()
    page.get_by_role("option", name=option, exact=True).first.click()
    page.wait_for_timeout(BETWEEN)


def press(page: Page, button: str) -> None:
    page.get_by_role("button", name=button, exact=True).first.click()
    page.wait_for_timeout(BETWEEN)


def tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name, exact=True).click()
    page.wait_for_timeout(BETWEEN)


def unfold(page: Page, title: str, at: int = 0) -> None:
    """Opens a folder and waits until it has its full height. Before that, a control may move between the
    press and the release of the mouse, and would then receive no click."""
    folder = page.get_by_text(title, exact=True).nth(at)
    folder.click()
    assert eventually(page, lambda: folder.evaluate("(title) => !title.nextElementSibling.style.height"))


def key(page: Page, name: str) -> None:
    page.keyboard.press(name)
    page.wait_for_timeout(BETWEEN)


def position(page: Page, node: str) -> tuple[float, float, float]:
    """Returns the position at which the browser draws a node, in its parent's frame."""
    found: Any = page.evaluate(
        "(n) => { const p = window.__viserMutable.nodeRefFromName[n].position; return [p.x, p.y, p.z]; }",
        node,
    )
    return float(found[0]), float(found[1]), float(found[2])


def is_drawn(page: Page, node: str) -> bool:
    return bool(
        page.evaluate(
            "(n) => { const x = window.__viserMutable.nodeRefFromName[n]; return !!x && x.visible; }", node
        )
    )


def camera(page: Page) -> tuple[float, float, float]:
    """Returns the position of the camera in the browser's own frame."""
    found: Any = page.evaluate(
        "() => { const p = window.__viserMutable.camera.position; return [p.x, p.y, p.z]; }"
    )
    return float(found[0]), float(found[1]), float(found[2])


def sheet(page: Page) -> tuple[float, float]:
    """Returns the left and right edge of the panel on a phone, in pixels."""
    found: Any = page.evaluate(
        """() => { const r = [...document.querySelectorAll("div")].find((d) =>
             getComputedStyle(d).position === "fixed" && d.textContent.includes("Playback"))
             .getBoundingClientRect(); return [r.left, r.right]; }"""
    )
    return float(found[0]), float(found[1])


def target_position(page: Page, node: str = "/target/ball") -> tuple[float, float, float]:
    """Returns the position at which the browser draws the target's ball, in world coordinates."""
    found: Any = page.evaluate(
        """(node) => { const m = window.__viserMutable;
             const world = (name) => { const n = m.nodeRefFromName[name]; n.updateWorldMatrix(true, false);
                                       return n.matrixWorld.clone(); };
             const p = world("").invert().multiply(world(node)).elements;
             return [p[12], p[13], p[14]]; }""",
        node,
    )
    return float(found[0]), float(found[1]), float(found[2])


def point_on_page(page: Page, node: str, at: tuple[float, float, float]) -> tuple[float, float]:
    """Returns where the page shows a point that is given in a node's frame, m, in CSS pixels."""
    x, y = page.evaluate(_PROJECT, [node, list(at)])
    return float(x), float(y)


@contextmanager
def often(page: Page) -> Iterator[None]:
    """Within this context the time between two frames is `OFTEN`."""
    before: Any = page.evaluate(
        "(rest) => { const before = window.picturesRest; window.picturesRest = rest; return before; }", OFTEN
    )
    try:
        yield
    finally:
        page.evaluate("(rest) => { window.picturesRest = rest; }", before)


def drag_target(page: Page, axis: int, along: float, node: str = "/target", arm: float = 0.18) -> None:
    """Drags the gizmo's arrow along a world axis by a distance, m. The mouse grabs the arrow at the
    distance `arm` from the gizmo's centre, m."""
    direction = [0.0, 0.0, 0.0]
    direction[axis] = 1.0
    with often(page):
        _see(page)  # a change of the camera takes effect with the next frame
        start = page.evaluate(_PROJECT, [node, [arm * c for c in direction]])
        end = page.evaluate(_PROJECT, [node, [(arm + along) * c for c in direction]])
        _drag(page, start, end)


def click_on(page: Page, node: str) -> None:
    """Clicks on the centre of a mesh."""
    middle = page.evaluate(
        """(node) => { let found = null;
             window.__viserMutable.nodeRefFromName[node].traverse((o) => {
               if (!o.isMesh || found) return;
               o.geometry.computeBoundingSphere(); found = o.geometry.boundingSphere.center; });
             return [found.x, found.y, found.z]; }""",
        node,
    )
    with often(page):
        _see(page)
        page.mouse.move(*page.evaluate(_PROJECT, [node, middle]))
        _see(page)
        page.mouse.down()
        page.mouse.up()
        page.wait_for_timeout(BETWEEN)


def turn_target(page: Page, degrees: float) -> None:
    """Drags the ring around the target's own z axis."""
    radius = 0.16  # m: 0.65 of the gizmo's size for the iiwa

    def on_ring(angle: float) -> Any:
        at = [radius * math.cos(math.radians(angle)), radius * math.sin(math.radians(angle)), 0.0]
        return page.evaluate(_PROJECT, ["/target/turn", at])

    with often(page):
        _see(page)
        _drag(page, on_ring(45.0), on_ring(45.0 + degrees))


def _see(page: Page) -> None:
    """Waits until the browser has drawn the next frames, at most a minute, and then for 0.25 s."""
    page.evaluate(_PICTURES)
    page.wait_for_timeout(250)


def _drag(page: Page, start: list[float], end: list[float]) -> None:
    """Drags the mouse in twelve steps, as a user would."""
    page.mouse.move(*start)
    _see(page)  # the arrow must have received the mouse event first
    page.mouse.down()
    for k in range(1, 13):
        page.mouse.move(*(s + (e - s) * k / 12 for s, e in zip(start, end, strict=True)))
        page.wait_for_timeout(25)
    page.mouse.up()
    page.wait_for_timeout(BETWEEN)


def eventually(page: Page, condition: Callable[[], bool], timeout: float = 40.0) -> bool:
    """Waits for a condition while the browser continues; returns whether it became true."""
    for _ in range(int(timeout / 0.1)):
        if condition():
            return True
        page.wait_for_timeout(100)
    return False
