"""Treatment of the exceptions of callbacks. A callback may still run while its page is rebuilt, and may then
write to a removed control."""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

_LATE = " on a removed "


def is_removed_handle_error(error: BaseException) -> bool:
    """Returns whether an exception is viser's refusal to write to a removed control or node. Such an
    exception can be ignored, as the page does not show that control or node any more."""
    return isinstance(error, RuntimeError) and _LATE in str(error)


def unless_removed(fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Calls a function and returns its result; None if the function wrote to a removed control or node."""
    try:
        return fn(*args, **kwargs)
    except RuntimeError as error:
        if not is_removed_handle_error(error):
            raise
        return None


def print_exception(future: Future[Any]) -> None:
    """Callback for a finished future: prints the exception of a thread, which would otherwise be lost."""
    if not future.cancelled() and (error := future.exception()) is not None:
        traceback.print_exception(error, file=sys.stderr)


async def call(back: Callable[[Any], Any], event: Any, threads: Executor) -> None:
    """Calls a callback, on the event loop if it is a coroutine function. Exceptions are passed on."""
    if inspect.iscoroutinefunction(back):
        await back(event)
    else:
        threads.submit(back, event).add_done_callback(print_exception)
