"""The notebook in examples/ runs in a kernel, and Python and the page control the same robot."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from app.jupyter.lab import Lab, Surroundings, outside, surroundings
from app.link.choice import SceneChoice
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec
from robots import InputError

ROOT = Path(__file__).parents[1]
LONG = 120


def test_the_notebook_shows_the_page_and_moves_the_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outside of a Jupyter server the cell shows a link, and the hand rises by the distance that the notebook
    requests."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.delenv("JUPYTERHUB_SERVICE_PREFIX", raising=False)
    notebook = nbformat.read(ROOT / "examples" / "notebook.ipynb", as_version=4)
    nbformat.validate(notebook)
    client = NotebookClient(notebook, timeout=3 * LONG, kernel_name="python3")
    client.execute(cwd=str(tmp_path))
    codes = [cell for cell in notebook.cells if cell.cell_type == "code"]
    (shown,) = (each for each in codes[0].outputs if each.output_type == "display_data")
    assert re.search(r'href="http://127\.0\.0\.1:\d+/\?himpc-token=', shown["data"]["text/html"])
    printed = "".join(each.get("text", "") for cell in codes for each in cell.outputs)
    assert "horizon: 10" in printed
    rose = re.search(r"rose, mm: ([\d.]+)", printed)
    assert rose is not None and abs(float(rose[1]) - 100.0) < 1.0


@pytest.fixture(scope="module")
def lab() -> Iterator[Lab]:
    with Lab(SceneChoice(RunSpec("planar3-hold")), ["http://localhost:8888"]) as made:
        yield made


def test_the_page_and_python_have_one_robot(lab: Lab) -> None:
    """Python and two cells that show the page control the same robot. Only the page of the notebook may show
    it in a frame."""
    with Wire(lab.url) as page, Wire(lab.url) as other:
        lab.set("horizon", 7)
        for each in (page, other):
            assert eventually(lambda wire=each: _value(wire, "N") == 7, LONG)
        page.use("N", 4)
        assert eventually(lambda: lab.settings.as_data()["horizon"] == 4, LONG)
    rows = lab.rows()
    assert rows["q"].shape == (len(rows["t"]), 3) and np.isfinite(rows["q"]).all()


def test_a_target_moves_while_the_robot_is_paused(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    """`move` returns when the target is in force; for that, no tick must run."""
    monkeypatch.setattr("app.jupyter.lab._PATIENCE", 20.0)
    with Wire(lab.url) as page:
        assert eventually(lambda: page.shows("t = "), LONG)
        page.press_key("space")
        learner = lab._learner
        assert eventually(lambda: learner.status is not None and not learner.status.running, LONG)
        for place in (0.5, 0.6):
            lab.move("position", (place, 0.1))
            assert learner.status is not None and not learner.status.running
            assert tuple(learner.status.targets["position"]) == (place, 0.1)
        page.press_key("space")
        lab.move("position", (0.7, 0.1))
        assert learner.status.running and tuple(learner.status.targets["position"]) == (0.7, 0.1)


def test_wrong_input_is_a_sentence(lab: Lab) -> None:
    for wrong, words in (
        (lambda: lab.set("horizont", 7), "did you mean 'horizon'"),
        (lambda: lab.set("horizon", 7.5), "horizon"),
        (lambda: lab.move("elbow", (0, 0, 0)), "Choose one of"),
        (lambda: lab.move(lab.tasks[0], (0, float("nan"))), "finite numbers"),
    ):
        with pytest.raises(InputError, match=words):
            wrong()


def test_a_lab_that_was_stopped_says_so(lab: Lab) -> None:
    lab.stop()
    lab.stop()
    with pytest.raises(InputError, match="was stopped"):
        lab.rows()


def test_the_frame_has_the_address_at_which_jupyter_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With Jupyter's proxy the address has no host, so that it works with every name of the server. Without
    the proxy, it has the host name under which Jupyter was opened, and only a page from there may show the
    frame."""
    proxied = Surroundings("http://localhost:8888/user/zoe/", True)
    assert proxied.source(1, "a=b") == "/user/zoe/proxy/1/?a=b" and proxied.embedders == ("'self'",)
    direct = Surroundings("http://localhost:8888/", False)
    assert direct.source(1, "a=b") == "http://localhost:1/?a=b"
    assert direct.embedders == ("http://localhost:8888",)
    hub = {"JUPYTERHUB_SERVICE_PREFIX": "/user/zoe/", "JUPYTERHUB_PUBLIC_URL": "https://hub.example.org/"}
    found = surroundings(hub)
    assert found is not None and found.origin == "https://hub.example.org"
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
    assert surroundings({"JPY_PARENT_PID": "12"}) is None
    (tmp_path / "jpserver-12.json").write_text('{"url": "http://127.0.0.1:8889/lab/"}')
    found = surroundings({"JPY_PARENT_PID": "12"})
    assert found is not None and found.address == "http://127.0.0.1:8889/lab/"
    assert surroundings({}) is None
    assert surroundings(hub | {"COLAB_RELEASE_TAG": "1"}) is None  # no browser can reach its server


def test_a_notebook_elsewhere_says_what_to_do() -> None:
    """Colab gets a sentence instead of an address that does not work; VS Code needs its port."""
    reachable, note = outside({"COLAB_RELEASE_TAG": "release-colab_20261101"}, 8080)
    assert not reachable and "your own machine" in note
    reachable, note = outside({"VSCODE_PID": "7"}, 8080)
    assert reachable and "8080" in note
    assert outside({}, 8080) == (True, "")


def _value(page: Wire, label: str) -> object:
    found = page.controls.get(page.find(label) or "", {})
    return found.get("value", found.get("props", {}).get("value"))
