"""`vrs lsp`: the language server, which editors start for themselves."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from importlib.util import find_spec

from vrs_cli.cli.command_line import ROBOT, CommandLineError, chosen_robot, command, option
from vrs_cli.extras import how_to_install


def lsp(options: Namespace) -> None:
    """Serve one editor over standard input and output until it says goodbye."""
    if find_spec("pygls") is None:
        raise CommandLineError("the language server needs pygls, which is not installed", how_to_install("pygls"))
    from vrs_cli.lsp.server import server

    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")  # pygls closes what it writes to
    server(chosen_robot(options)).start_io(sys.stdin.buffer, output)


lsp_parser = command(
    "The VAL-II language server (LSP), over standard input and output.",
    """\
Diagnostics while you type, completion, help under the pointer, go to definition, outline, formatting.
How editors are told to start it: docs/editors.md.
""",
    option("--stdio", action="store_true", help="the only way it speaks; some editors say so"),
    *ROBOT,
)
