"""Runs a function on independent items on all local cores; `cluster` does the same on other machines.

An item that fails gives an outcome, too, and the others continue. Outcomes come in the order in which they
are ready; each outcome has the index of its item, so that results do not depend on the speed of the
processes.
"""

from __future__ import annotations

import multiprocessing as mp
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import Protocol, TypeVar

from robots import InputError
from robots.processes.environment import environment
from robots.processes.orphans import end_with_parent

T = TypeVar("T")
U = TypeVar("U")

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class FailedJob:
    """A failed item: one sentence that says why it has no result."""

    reason: str


class Spread(Protocol):
    """A function that spreads work over processes. It yields (index of the item, its outcome), in the order
    in which the outcomes become ready. Closing the generator ends the work that still runs."""

    def __call__(
        self, function: Callable[[T], U], items: Sequence[T]
    ) -> Generator[tuple[int, U | FailedJob], None, None]: ...


def cores() -> int:
    """Returns the number of cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return max(1, len(affinity(0)) if affinity else os.cpu_count() or 1)


def on_cores(
    function: Callable[[T], U], items: Sequence[T]
) -> Generator[tuple[int, U | FailedJob], None, None]:
    """Spreads work over spawned processes, one per core, each with one thread of linear algebra.

    Args:
        function: importable by name; its argument and result can be pickled.
        items: its arguments.

    Yields:
        (index of the item, its result). The result is a `FailedJob` if the function raised an exception, or
        if its process ended unexpectedly twice.
    """
    waiting = deque(range(len(items)))
    while waiting:
        orphans = yield from _until_one_dies(function, items, waiting)
        # A process that dies also ends the other work of its pool. The items are therefore repeated one at a
        # time, which shows which item ends its process.
        for index in sorted(orphans):
            yield index, _alone(function, items[index])


def _until_one_dies(
    function: Callable[[T], U], items: Sequence[T], waiting: deque[int]
) -> Generator[tuple[int, U | FailedJob], None, list[int]]:
    """Runs the items with the indices in `waiting` until none is left or a process dies; returns the indices
    of the items whose work was lost with that process."""
    under_way: dict[Future[U | FailedJob], int] = {}
    orphans: list[int] = []
    workers = min(cores(), len(waiting))
    with _pool(workers) as pool, suppress(BrokenProcessPool):
        while not orphans and (waiting or under_way):
            with _signals_blocked():
                # At most one item per process is submitted: if a process dies, the items that wait are not
                # lost.
                while waiting and len(under_way) < workers:
                    future = pool.submit(guarded, function, items[waiting[0]])
                    under_way[future] = waiting.popleft()
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                index = under_way.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    orphans.append(index)
                else:
                    yield index, future.result()
    return [*orphans, *under_way.values()]


def one_by_one(
    function: Callable[[T], U], items: Sequence[T]
) -> Generator[tuple[int, U | FailedJob], None, None]:
    """As `on_cores`, but in this process and in order: for measuring times, and for tests."""
    for index, item in enumerate(items):
        yield index, guarded(function, item)


def guarded(function: Callable[[T], U], item: T) -> U | FailedJob:
    """Returns the result of the function, or a failure if the function raised an exception."""
    try:
        return function(item)
    except Exception as error:
        return FailedJob(sentence(error))


def sentence(error: BaseException) -> str:
    """Returns an error in one line, with the name of its class. The name is omitted for an InputError, which
    is a sentence."""
    text = " ".join(str(error).split()) or "no reason given"
    return text if isinstance(error, InputError) else f"{type(error).__name__}: {text}"


def _alone(function: Callable[[T], U], item: T) -> U | FailedJob:
    with _pool(1) as pool:
        with _signals_blocked():
            future = pool.submit(guarded, function, item)
        try:
            return future.result()
        except BrokenProcessPool:
            return FailedJob(
                "its process ended unexpectedly (out of memory, or a crash in a compiled library)"
            )


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yields a pool of spawned processes that end at once if their owner is interrupted or ends in any
    way."""
    others = set(mp.active_children())
    pool = ProcessPoolExecutor(workers, mp.get_context("spawn"), initializer=_obey_the_owner)
    try:
        with _one_thread_each():
            yield pool
    except BaseException:
        for child in set(mp.active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _signals_blocked() -> Iterator[None]:
    """Blocks Ctrl-C while processes start. A child inherits the block: otherwise Ctrl-C would end the child
    with a traceback before our code runs in it. In the owner the block prevents a half-finished start; a
    signal that arrives meanwhile, in any thread, is handled afterwards.
    """
    heard: list[int] = []
    handlers: dict[int, Callable[[int, FrameType | None], object] | int | None] = {}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(signal.getsignal(number)):
                handlers[number] = signal.signal(number, lambda came, _: heard.append(came))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number in heard[:1]:
            signal.raise_signal(number)


def _obey_the_owner() -> None:
    # Ctrl-C in a terminal reaches the whole process group; the owner ends its children itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()


def _one_thread_each() -> AbstractContextManager[None]:
    """Sets environment variables that children inherit. NumPy reads them when it is first imported, before
    any code of ours runs in a child."""
    return environment(dict.fromkeys(_THREADS, "1"))
