"""`vrs config`: the settings of the shell, and the file that has them."""

from __future__ import annotations

import os
import sys
from argparse import Namespace

from vrs_cli.cli.command_line import Parser, option
from vrs_cli.cli.main import FAILED, OK

EPILOG = """\
What it prints can be the file itself. What is wrong in the file is told on standard error, and the status is 1.

  vrs config
  mkdir -p "$(dirname "$(vrs config --path)")" && vrs config > my.toml && mv my.toml "$(vrs config --path)"
"""


def main(options: Namespace) -> int:
    """Print what holds."""
    from vrs_cli.repl.config import config_path, read_config, shown

    path = config_path(os.environ)
    if options.path:
        print(path)
        return OK
    config = read_config(os.environ)
    print(f"# {path}{'' if path.exists() else ' (not there: these are the defaults)'}")
    print(shown(config), end="")
    for what in config.wrong:
        print(f"{options.prog}: {what}", file=sys.stderr)
    return FAILED if config.wrong else OK


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "The settings of the shell: keys, pager, suggestions, colours.",
        EPILOG,
        option("--path", action="store_true", help="print the name of the file alone"),
    )
