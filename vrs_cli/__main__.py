"""The `vrs` command. Only what the first words of the command line ask for is imported."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from vrs_cli.version import __version__

COLLECT_AFTER = 100_000  # new objects before a collection; high, because objects loaded at the start stay in use


def process() -> None:
    """Be the process of a `vrs` command: run it, and end."""
    gc.set_threshold(COLLECT_AFTER)
    status = main()
    gc.freeze()  # the end looks for no garbage, since the system takes all memory back
    sys.exit(status)


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
