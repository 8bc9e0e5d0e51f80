"""What callbacks raise: a page may be built anew while one of its controls' still runs, and is late."""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

_LATE = " on a removed "


def is_removed_handle_error(error: BaseException) -> bool:
    """Whether an exception is viser's refusal of a write to a control or node that was removed. Nobody
    sees it any more, so nothing is missed."""
    return isinstance(error, RuntimeError) and _LATE in str(error)


def unless_removed(fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """What a function gives; None if what it wrote to is gone meanwhile."""
    try:
        return fn(*args, **kwargs)
    except RuntimeError as error:
        if not is_removed_handle_error(error):
            raise
        return None


def print_exception(future: Future[Any]) -> None:
    """Done-callback: an exception in a thread of its own is not lost."""
    if not future.cancelled() and (error := future.exception()) is not None:
        traceback.print_exception(error, file=sys.stderr)


async def call(back: Callable[[Any], Any], event: Any, threads: Executor) -> None:
    """Calls a callback, on the loop if it is a coroutine's; what that raises is raised."""
    if inspect.iscoroutinefunction(back):
        await back(event)
    else:
        threads.submit(back, event).add_done_callback(print_exception)
