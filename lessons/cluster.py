"""Runs independent work on the workers of an existing Dask scheduler, as `parallel` does on local cores."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, TypeVar
from urllib.parse import urlsplit

from lessons.parallel import FailedJob, Spread, guarded, sentence
from robots import InputError

T = TypeVar("T")
U = TypeVar("U")

WORKER_TIMEOUT_S = 60.0
"""Time, s, that a scheduler may be without workers before the work is given up. A worker that died is usually
replaced sooner."""
_CHECK_PERIOD_S = 1.0  # time between two checks for workers, s


@contextmanager
def on_cluster(address: str) -> Iterator[Spread]:
    """Yields a function that spreads work over the workers of an existing Dask scheduler. himpc-lab must be
    installed on the workers.

    Raises:
        InputError: dask.distributed is not installed, or no scheduler answers at the address. Later: the
            connection to the scheduler is lost, or the scheduler has no worker for `WORKER_TIMEOUT_S` s.
    """
    try:
        from distributed import Client
        from distributed import as_completed as as_they_end
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise InputError(
            '--scheduler needs dask.distributed: pip install "himpc-lab[cluster]", or leave it out '
            "to use this machine's cores"
        ) from None
    # A plain socket tries the address first: a Client that finds no scheduler would continue trying in the
    # background.
    try:
        parts = urlsplit(address)
        socket.create_connection((parts.hostname or "", parts.port or 0), timeout=10).close()
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there ({type(error).__name__}); "
            "give its address as dask prints it, e.g. tcp://10.0.0.1:8786"
        ) from None

    def ended(futures: list[Any]) -> Iterator[Any]:
        coming = as_they_end(futures)
        checked = worked = time.monotonic()
        while not coming.is_empty():
            if coming.has_ready():
                yield next(coming)
                continue
            time.sleep(0.05)
            if time.monotonic() - checked < _CHECK_PERIOD_S:
                continue
            checked = time.monotonic()
            if client.nthreads():
                worked = checked
            elif checked - worked >= WORKER_TIMEOUT_S:
                raise InputError(
                    f"--scheduler {address}: no worker for {WORKER_TIMEOUT_S:.0f} s. Start a worker with "
                    f'"dask worker {address}", then repeat the command'
                )

    def spread(
        function: Callable[[T], U], items: Sequence[T]
    ) -> Generator[tuple[int, U | FailedJob], None, None]:
        # pure=False: two equal items are two pieces of work. A lost worker does not count as a failure: the
        # scheduler gives its work to another worker, up to its `allowed-failures` (3) times.
        orphans: list[int] = []
        futures = [client.submit(guarded, function, item, pure=False) for item in items]
        indices = {future.key: index for index, future in enumerate(futures)}
        try:
            for future in ended(futures):
                index, error = indices[future.key], future.exception()
                if isinstance(error, KilledWorker):
                    orphans.append(index)
                else:
                    yield index, future.result() if error is None else FailedJob(sentence(error))
            # A worker that dies also loses the items that waited for it. The items are therefore repeated one
            # at a time, which shows which item ends its worker.
            for index in sorted(orphans):
                alone = client.submit(guarded, function, items[index], pure=False)
                futures.append(alone)
                for future in ended([alone]):
                    error = future.exception()
                    yield index, future.result() if error is None else FailedJob(sentence(error))
        except (OSError, CancelledError):
            raise InputError(
                f"--scheduler {address}: the scheduler no longer answers. Start it, then repeat the command"
            ) from None
        finally:
            client.cancel(futures)

    with _quiet(), client:
        yield spread


@contextmanager
def _quiet() -> Iterator[None]:
    """Hides the tracebacks that a client logs when it loses its scheduler; users get one sentence."""
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(before)
