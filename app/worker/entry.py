"""The module with which simulation processes start. The server refers to this module by its name. The module
imports little, so that it can report the progress of the other imports."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection


def warm(say: Callable[[str], None]) -> None:
    """Imports everything that simulations need. say: called with sentences about the progress, for a page
    that waits."""
    from himpc.compilation.compiling import compile_all

    compile_all(
        lambda ready, of: say(
            f"compiling the controllers, only this time, for about half a minute: {ready} of {of} functions"
        )
    )
    from app.worker.main import rehearse

    rehearse()


def main(page: Connection) -> None:
    """Runs a simulation until the page sends Quit or ends."""
    from app.worker.main import main as simulate

    simulate(page)
