"""Work on untrusted files runs in separate processes: every failure is reported in one sentence, and no
process remains."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import misbehaving
import psutil
import pytest
from arms import two_joint_arm
from hostile import chain

from robots import InputError, check_urdf, load_robot, load_urdf_text
from robots.processes import isolation
from robots.processes.isolation import Fault, isolated


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (misbehaving.crash, "SIGSEGV"),
        (misbehaving.eat, "1 GB of memory"),
        (misbehaving.descend, "too deeply"),
    ],
)
def test_a_crash_is_a_sentence(work, words: str) -> None:
    with pytest.raises(Fault, match=words):
        isolated(work)


def test_the_deadline_is_a_sentence(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(isolation, "DEADLINE", 2.0)
    with pytest.raises(Fault, match="takes longer"):
        isolated(misbehaving.stay, str(tmp_path / "pid"))


def test_waiting_for_a_core_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """The deadline does not include the time in which a process waits for a core; another limit applies to
    the total time."""
    monkeypatch.setattr(isolation, "waited", lambda pid: 100.0)
    assert isolated(time.sleep, 3.0, within=isolation.Allowance(2.0)) is None
    monkeypatch.setattr(isolation, "PATIENCE", 2.0)
    with pytest.raises(Fault, match="takes longer than 1 s"):
        isolated(time.sleep, 100.0, within=isolation.Allowance(1.0))


def test_what_libraries_print_does_not_spoil_the_answer() -> None:
    assert isolated(misbehaving.chatter) == "heard"


@pytest.fixture(scope="module")
def alone() -> Iterator[ProcessPoolExecutor]:
    """A process with one thread; only such a process can be copied."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield pool


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (misbehaving.crash, "SIGSEGV"),
        (misbehaving.eat, "1 GB of memory"),
        (misbehaving.descend, "too deeply"),
        (misbehaving.leave, "exit code 0"),
        (time.sleep, "takes longer than 1 s"),
    ],
)
def test_a_copy_that_crashes_is_a_sentence(work, words: str, alone: ProcessPoolExecutor) -> None:
    args, seconds = ((3600.0,), 1.0) if work is time.sleep else ((), 10.0)
    answer = alone.submit(misbehaving.apart, work, *args, seconds=seconds).result(60)
    assert words in answer


@pytest.mark.skipif(sys.platform != "linux", reason="other systems make no copies")
def test_a_copy_has_what_is_imported_and_nothing_that_is_open(alone: ProcessPoolExecutor) -> None:
    """A copy has the imported modules, but no open file of the original except its standard streams. Changes
    in the copy do not affect the original."""
    for _ in range(2):
        seen = alone.submit(misbehaving.apart, misbehaving.seen_by, "a copy").result(60)
        assert seen == ["the original", "a copy"]
    assert alone.submit(misbehaving.open_files).result(60)
    assert alone.submit(misbehaving.apart, misbehaving.open_files).result(60) == {"/memfd:answer"}
    assert alone.submit(misbehaving.apart, misbehaving.chatter).result(60) == "heard"


def test_a_process_with_two_threads_is_not_copied() -> None:
    """A lock that the second thread holds would stay locked in a copy; therefore no copy is made."""
    over = threading.Event()
    other = threading.Thread(target=over.wait)
    other.start()
    try:
        assert misbehaving.apart(misbehaving.seen_by, "another") == ["another"]
    finally:
        over.set()
        other.join()


@pytest.mark.parametrize("copied", [False, True])
def test_it_dies_with_its_parent(tmp_path: Path, copied: bool) -> None:
    file = tmp_path / "pid"
    code = (
        "import misbehaving; from robots.processes.isolation import isolated as i; "
        f"i(misbehaving.stay, {str(file)!r}, copied={copied})"
    )
    path = os.pathsep.join(filter(None, sys.path))
    environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
    with subprocess.Popen([sys.executable, "-c", code], env=environment) as parent:
        while not (file.exists() and file.read_text()):
            assert parent.poll() is None
            time.sleep(0.02)
        parent.kill()
    child = int(file.read_text())
    end = time.monotonic() + 5.0
    while psutil.pid_exists(child) and psutil.Process(child).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < end, "the importer outlived its parent by 5 s"
        time.sleep(0.02)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems make no copies")
def test_what_it_starts_ends_with_it(alone: ProcessPoolExecutor) -> None:
    left = alone.submit(misbehaving.apart, misbehaving.multiply).result(60)
    end = time.monotonic() + 5.0
    while psutil.pid_exists(left) and psutil.Process(left).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < end, "what was started outlived what started it by 5 s"
        time.sleep(0.02)


def test_a_daemonic_process_may_load() -> None:
    """A simulation runs in a daemonic process, which may not have children of `multiprocessing`."""
    context = multiprocessing.get_context("spawn")
    answers = context.Queue()
    for text, expected in ((two_joint_arm(), 2), (chain(21), "21 moving joints")):
        process = context.Process(target=misbehaving.load_in_a_daemon, args=(text, answers), daemon=True)
        process.start()
        answer = answers.get(timeout=60.0)
        process.join()
        assert answer == expected or str(expected) in str(answer)


def test_check_and_load_go_the_same_way(tmp_path: Path) -> None:
    for text in (two_joint_arm(), chain(10_000, "fixed"), chain(60), ""):
        file = tmp_path / "arm.urdf"
        file.write_text(text)
        report = check_urdf(file)
        try:
            robot = load_robot(file)
        except InputError as error:
            assert not report.usable
            assert report.of_kind("refused")[0].text in str(error)
        else:
            assert robot.report == report


def test_a_file_is_read_again_when_it_changed_or_names_a_mesh(monkeypatch, tmp_path: Path) -> None:
    """A mesh file may change while the file that names it stays the same; therefore a file that names a mesh
    is always read again."""
    read: list[object] = []

    def here(work, *told: object):
        read.append(work)
        return work(*told)

    monkeypatch.setattr("robots.loading.load.isolated", here)
    file, text = tmp_path / "arm.urdf", two_joint_arm()
    for comment, times in (("", 1), ("", 1), ("<!-- new -->", 2), ("<!-- mesh -->", 3), ("<!-- mesh -->", 4)):
        file.write_text(text.replace("</robot>", f"{comment}</robot>"))
        assert load_robot(file).n == 2
        assert len(read) == times


def test_a_crash_while_loading_is_reported_and_refused(monkeypatch, tmp_path: Path) -> None:
    # A lambda cannot be sent to another process.
    monkeypatch.setattr("robots.loading.load.import_robot", lambda *_: None)
    monkeypatch.setattr("robots.loading.load.isolated", _faulty)
    file = tmp_path / "arm.urdf"
    file.write_text(two_joint_arm())
    assert "SIGBUS" in str(check_urdf(file).findings)
    with pytest.raises(InputError, match="SIGBUS"):
        load_urdf_text(two_joint_arm())


def _faulty(*_: object) -> None:
    raise Fault("reading it ended the importer (SIGBUS)")


@pytest.mark.parametrize(
    "path", ["a" * 100_000, "/" + "b/" * 50_000 + "c.urdf", "nul\0byte.urdf", "/dev/zero"]
)
def test_a_path_that_is_none_is_answered_briefly(path: str) -> None:
    for use in (load_robot, check_urdf):
        began = time.process_time()
        with pytest.raises(InputError) as caught:
            use(path)
        assert time.process_time() - began < 5.0
        assert len(str(caught.value)) < 400
        assert str(caught.value).isprintable()


def test_an_unknown_tip_is_answered_briefly() -> None:
    with pytest.raises(InputError) as caught:
        load_urdf_text(two_joint_arm(), "n" * 100_000)
    assert len(str(caught.value)) < 400
    with pytest.raises(InputError, match="did you mean 'l2'"):
        load_urdf_text(two_joint_arm(), "l22")


def test_text_that_cannot_be_encoded_is_refused() -> None:
    with pytest.raises(InputError):
        load_urdf_text("\ud800" + two_joint_arm())
