"""The `vrs` command. Only what the first words of the command line ask for is imported."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Sequence
from contextlib import suppress

from vrs_cli.version import __version__

COLLECT_AFTER = 100_000  # new objects before a collection; high, because objects loaded at the start stay in use


def process() -> None:
    """Be the process of a `vrs` command: run it, and end."""
    gc.set_threshold(COLLECT_AFTER)
    status = main()
    gc.freeze()  # the end looks for no garbage, since the system takes all memory back
    threading = sys.modules.get("threading")
    if threading is None or threading.active_count() == 1:
        _leave(status)
    sys.exit(status)  # waits for the other threads


def _leave(status: int) -> None:
    """End the process without taking apart its modules, which takes the interpreter longer than a short command."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # a stream may be closed, or have no reader any more
            stream.flush()
    os._exit(status)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `vrs` with these arguments (default: of the process); returns the exit status."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    if arguments and arguments[0] in ("--version", "-V"):
        try:
            print(f"vrs {__version__}", flush=True)
            return 0
        except (OSError, AttributeError):
            pass  # what to do if it cannot be written, `vrs_cli.cli.main` knows
    from vrs_cli.cli.main import run

    return run(arguments)


if __name__ == "__main__":
    process()
