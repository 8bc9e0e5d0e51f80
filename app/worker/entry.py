"""What a process of simulations is told to run, by name. Light itself, so that it can say what it loads."""

from __future__ import annotations

from collections.abc import Callable

from app.link.wire import Wire


def warm(say: Callable[[str], None]) -> None:
    """Loads all that simulations need. `say` is told what is being done, for a page that waits."""
    from himpc.compilation.compiling import compile_all

    compile_all(lambda ready, of: say(f"compiling the controllers, this once: {ready} of {of} functions"))
    from app.worker.main import rehearse

    rehearse()


def main(wire: Wire) -> None:
    """A simulation, until the page says Quit or is gone."""
    from app.worker.main import main as simulate

    simulate(wire)
