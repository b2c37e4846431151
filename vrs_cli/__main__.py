"""Run the `vrs` command. Import only the modules that the first words of the command line need."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Sequence
from contextlib import suppress

from vrs_cli.version import __version__

# new objects that start a garbage collection; high, because objects loaded at start-up are never freed
COLLECT_AFTER = 100_000


def process() -> None:
    """Run a `vrs` command as the whole process, and exit with its status."""
    gc.set_threshold(COLLECT_AFTER)
    status = main()
    gc.freeze()  # skip the garbage collection at exit: the operating system frees all memory
    threading = sys.modules.get("threading")
    if threading is None or threading.active_count() == 1:
        _leave(status)
    sys.exit(status)  # waits for the other threads


def _leave(status: int) -> None:
    """End the process without the interpreter's cleanup of modules, which takes longer than a short command."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # a stream may be closed, or its reader may be gone
            stream.flush()
    os._exit(status)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `vrs` with these arguments (default: those of the process). Return the exit status."""
    arguments = sys.argv[1:] if argv is None else list(argv)
    if arguments and arguments[0] in ("--version", "-V"):
        try:
            compiled = any(name.startswith("compiled__mypyc.") for name in os.listdir(os.path.dirname(__file__)))
            print(f"vrs {__version__}{' (compiled)' if compiled else ''}", flush=True)
            return 0
        except (OSError, AttributeError):
            pass  # `vrs_cli.cli.main` handles output that cannot be written
    from vrs_cli.cli.main import run

    return run(arguments)


if __name__ == "__main__":
    process()
