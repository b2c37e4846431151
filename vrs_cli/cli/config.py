"""`vrs config`: the settings of the shell, and the file that has them."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from vrs_cli.cli.command_line import Parser
from vrs_cli.cli.main import FAILED, OK

EPILOG = """\
What it prints can be the file itself. What is wrong in the file is told on standard error, and the status is 1.

  vrs config
  mkdir -p "$(dirname "$(vrs config --path)")" && vrs config > my.toml && mv my.toml "$(vrs config --path)"
"""


def main(prog: str, arguments: Sequence[str]) -> int:
    """Print what holds."""
    from vrs_cli.repl.config import config_path, read_config, shown

    options = parser(prog).parse(arguments)
    path = config_path(os.environ)
    if options.path:
        print(path)
        return OK
    config = read_config(os.environ)
    print(f"# {path}{'' if path.exists() else ' (not there: these are the defaults)'}")
    print(shown(config), end="")
    for what in config.wrong:
        print(f"{prog}: {what}", file=sys.stderr)
    return FAILED if config.wrong else OK


def parser(prog: str) -> Parser:
    parser = Parser(prog, "The settings of the shell: keys, pager, suggestions, colours.", EPILOG)
    parser.add_argument("--path", action="store_true", help="print the name of the file alone")
    return parser
