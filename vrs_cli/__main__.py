"""The `vrs` command. Only what the first words of the command line ask for is imported."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from vrs_cli.version import __version__

VERSION_OPTIONS = ("--version", "-V")
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
    if arguments and arguments[0] in VERSION_OPTIONS and _print_version():
        return 0
    from vrs_cli.cli.main import run

    return run(arguments)


def _print_version() -> bool:
    """Whether it could be written; what to do if not, `vrs_cli.cli.main` knows."""
    try:
        print(f"vrs {__version__}", flush=True)
    except (OSError, AttributeError):
        return False
    return True


if __name__ == "__main__":
    process()
