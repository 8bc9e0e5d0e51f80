"""`himpc-lab`: the command line."""

from __future__ import annotations

if __name__ == "__main__":
    import app.commands.early  # noqa: F401  (must be the first import)

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module

from app.commands.interrupts import interruptible
from app.commands.output import machine_failure

COMMANDS: dict[str, str] = {
    "serve": "open the page (the default if no command is given)",
    "run": "run a scene headless and print the results",
    "scenes": "list the scenes",
    "controllers": "list the controllers",
    "robots": "list the robots, or check a URDF",
    "lessons": "list the lessons, or check all their claims headless",
    "grade": "judge solutions of the exercises, one file or a folder of them",
    "new": "write a template of a controller, scene, lesson, task or exercise of your own",
    "bench": "compare the control-step times of himpc and of himpc_printed with each solver",
    "reproduce": "compare our results with the papers' tables and figures",
    "sweep": "run a grid of settings and draw a map; a stopped sweep can be continued",
    "export": "export a controller as C or WebAssembly, with its numbers and a recorded run to replay",
    "tune": "find M̄ step by step, as Remark 4 of the HIMPC paper says",
}
"""One line per command; the function `NAME(…) -> exit code` is in `app/commands/NAME.py`, or in `LISTS`."""
LISTS = ("scenes", "controllers", "robots")
"""The commands in `app/commands/lists.py`."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 success, 1 a claim failed, 2 wrong input."""
    with interruptible() as interrupted:
        try:
            return _flushed(list(sys.argv[1:] if argv is None else argv))
        except BrokenPipeError:
            # The reader of our output has closed the pipe (e.g. `| head`), so no message can be shown.
            _drop_output()
            return 0
        except BaseException as error:
            if interrupted.is_set():
                return 130
            reason = machine_failure(error)
            if reason is None:
                raise
            _drop_output()
            with suppress(OSError):
                print(f"himpc-lab: {reason}", file=sys.stderr)
            return 2


def _flushed(arguments: list[str]) -> int:
    """Runs a command and writes its output out, so that an error of writing is noticed here."""
    try:
        return _run(arguments)
    finally:
        if sys.stdout is not None:  # it is None if the program was started without standard output
            sys.stdout.flush()


def _drop_output() -> None:
    """Discards what is still to be written to standard output: Python writes it when the program ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(arguments: list[str]) -> int:
    from robots.errors import InputError, unknown_name

    name = arguments.pop(0) if arguments and not arguments[0].startswith("-") else "serve"
    try:
        if name not in COMMANDS:
            raise unknown_name("command", name, COMMANDS, "see himpc-lab --help")
        if name == "serve" and arguments[:1] in (["-h"], ["--help"]):
            _print_commands()
        return _call(name, arguments)
    except InputError as error:
        print(f"himpc-lab: {error}", file=sys.stderr)
        return 2


def _call(name: str, arguments: list[str]) -> int:
    import tyro

    module = "app.commands.lists" if name in LISTS else f"app.commands.{name}"
    command: Callable[..., int] = getattr(import_module(module), name)
    prog = "himpc-lab" if name == "serve" else f"himpc-lab {name}"
    # Flags have no negative form: tyro would make --no-no-browser out of --no-browser.
    return tyro.cli(command, prog=prog, args=arguments, config=(tyro.conf.FlagCreatePairsOff,))


def _print_commands() -> None:
    print("Commands (himpc-lab COMMAND --help shows the options of a command):")
    for name, line in COMMANDS.items():
        print(f"  {name:12} {line}")
    print()


if __name__ == "__main__":
    sys.exit(main())
