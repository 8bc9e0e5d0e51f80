"""If a file with compiled code is damaged, belongs to another user or cannot be written, the program still
starts, and the code in this file is never executed."""

from __future__ import annotations

import os
import resource
import shutil
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_himpc_compiling import start

from himpc.tick.kernel.target import roll


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An installation of a small function. It was compiled once and is now loaded from disk."""
    folder = tmp_path_factory.mktemp("compiled")
    assert [again(folder), again(folder)] == [2, 0]
    return folder


@pytest.fixture
def place(compiled: Path) -> Iterator[Path]:
    """The same installation, restored after each test."""
    (file,) = code_of(compiled)
    data = file.read_bytes()
    yield compiled
    os.chown(file.parent, os.getuid(), -1)
    file.parent.chmod(0o700)
    for each in {file, *code_of(compiled)}:  # a folder that is not trusted is replaced by another one
        each.unlink(missing_ok=True)
    file.touch(0o600)
    file.write_bytes(data)


def code_of(folder: Path) -> list[Path]:
    return sorted(folder.glob("tmp/**/*.code"))


def again(folder: Path, before: Callable[[], None] | None = None) -> int:
    """Starts a new process and returns how many functions it compiles; it must end without an error
    message."""
    process = start(folder, before=before)
    errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors[1]
    return int(errors[0].split()[0])


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "emptied": lambda _: b"",
    "cut": lambda data: data[: len(data) // 2],
    "no digest": lambda data: data[:20],
    "garbage": lambda data: np.random.default_rng(0).bytes(len(data)),
    "one bit": lambda data: data[:-100] + bytes([data[-100] ^ 1]) + data[-99:],
}


KEEPING = pytest.mark.nightly("himpc/compilation")


@pytest.mark.parametrize(
    "kind", [kind if kind == "one bit" else pytest.param(kind, marks=KEEPING) for kind in DAMAGE]
)
def test_a_damaged_file_is_compiled_anew_and_replaced(place: Path, kind: str) -> None:
    (file,) = code_of(place)
    file.write_bytes(DAMAGE[kind](file.read_bytes()))
    assert again(place) == 2
    assert again(place) == 0


def loaded() -> bool:
    """Whether one of our compiled functions can be loaded from its file."""
    return roll._cache.load_overload(roll.signatures[0], roll.targetctx) is not None


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    """The files with the code of that function, one for each processor that it was compiled for, copied to a
    folder of this test."""
    files = sorted(Path(roll.stats.cache_path).glob("target.roll-*.code"))
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path_factory.mktemp("kept")))
        yield [Path(shutil.copy(file, roll.stats.cache_path)) for file in files]


def test_one_bit_is_noticed_wherever_it_is(kept: list[Path]) -> None:
    whole = [file.read_bytes() for file in kept]
    assert loaded()

    @given(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 7))
    @settings(max_examples=200)
    def noticed(at: float, bit: int) -> None:
        for change in (
            lambda data, k: data[:k] + bytes([data[k] ^ (1 << bit)]) + data[k + 1 :],
            lambda data, k: data[:k],
        ):
            for file, data in zip(kept, whole, strict=True):
                file.write_bytes(change(data, int(at * len(data))))
            assert not loaded()

    noticed()


def full() -> None:
    """Limits the size of files, which has the effect of a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))


def test_on_a_full_disk_it_is_used_from_memory(place: Path) -> None:
    (file,) = code_of(place)
    file.unlink()
    assert again(place, full) == 2
    assert not code_of(place)
    assert not [each for each in place.glob("tmp/**/.*") if each.is_file()]  # no incomplete file is left
    assert again(place) == 2
    assert again(place, full) == 0


def test_what_is_kept_in_a_folder_that_cannot_be_written_to_is_used(place: Path) -> None:
    (file,) = code_of(place)
    file.parent.chmod(0o500)
    try:
        assert again(place) == 0
        file.chmod(0o600)
        file.write_bytes(b"")
        assert again(place) == 2
    finally:
        file.parent.chmod(0o700)


def open_to_all() -> None:
    os.umask(0)


def test_nobody_else_can_write_what_is_kept_whatever_the_umask(tmp_path: Path) -> None:
    assert again(tmp_path, open_to_all) == 2
    found = list((tmp_path / "tmp").rglob("*"))
    assert code_of(tmp_path)
    modes = {stat.S_IMODE(each.stat().st_mode) for each in found if each.is_file()}
    assert modes == {0o600}
    assert {stat.S_IMODE(each.stat().st_mode) for each in found if each.is_dir()} == {0o700}


@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_others_can_write_to_is_not_run(place: Path, what: str) -> None:
    (file,) = code_of(place)
    (file if what == "file" else file.parent).chmod(0o777)
    assert again(place) == 2


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give a file away")
@pytest.mark.parametrize("what", ["file", "folder"])
def test_what_belongs_to_somebody_else_is_not_run(place: Path, what: str) -> None:
    (file,) = code_of(place)
    os.chown(file if what == "file" else file.parent, 65534, 65534)
    assert again(place) == 2
