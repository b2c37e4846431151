"""`vrs token`: make tokens for those who are to enter a server, or take them back."""

from __future__ import annotations

import argparse
from argparse import Namespace
from datetime import date, datetime
from pathlib import Path

from vrs_cli.cli.command_line import CommandLineError, Parser, option
from vrs_cli.cli.main import OK

EPILOG = """\
The file holds hashes of tokens: what is printed here is told once. A server reads the file again when it changes.

  vrs token ada bob carl --file class.toml
  vrs token tom --file class.toml --role teacher
  vrs token eve --file class.toml --role observer --robots cell1 --expires 2027-07-31
  vrs token ada --file class.toml --revoke
"""


def main(options: Namespace) -> int:
    """Print a line for each name: the name and its token."""
    from vrs_cli.net.tokens import NAME_RULE, add_tokens, good_name, take_out

    wrong = next((name for name in options.names if not good_name(name)), None)
    if wrong is not None:
        raise CommandLineError(f"{wrong!r} is no name", NAME_RULE)
    path = Path(options.file)
    if options.revoke:
        take_out(path, options.names)
        return OK
    robots = None if options.robots is None else tuple(filter(None, options.robots.split(",")))
    for name, token in add_tokens(path, options.names, options.role, robots, options.expires).items():
        print(f"{name} {token}")
    return OK


def parser(prog: str) -> Parser:
    roles = ("observer", "designer", "supervisor", "teacher")
    return Parser(
        prog,
        "Make tokens, each for one who may enter a server (vrs serve --tokens FILE).",
        EPILOG,
        option("names", metavar="NAME", nargs="+", help="what others see; own robots are called so too"),
        option("--file", metavar="FILE", required=True, help="the file of tokens, made if need be"),
        option("--role", choices=roles, default="supervisor", help="what they may do (default: supervisor)"),
        option("--robots", metavar="A,B", help="the shared robots that they may hold (default: all)"),
        option("--expires", metavar="DAY", type=_day, help="until the end of that day, or an instant"),
        option("--revoke", action="store_true", help="take the tokens of these names out of the file"),
    )


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no day (2027-07-31, or 2027-07-31T12:00:00)") from None
