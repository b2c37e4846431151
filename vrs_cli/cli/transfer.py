"""`vrs put`, `vrs get`: files to and from the folder of a robot that is served."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import STANDARD_STREAM, Parser, option
from vrs_cli.cli.connections import EPILOG, URL, ask_once
from vrs_cli.errors import FileExists

if TYPE_CHECKING:
    from vrs_cli.net.messages import Request

PUT = """\
  vrs put pick.v2 ws://127.0.0.1/robots/cell1
  vrs put pick.v2 ws://127.0.0.1 --as best.v2 --replace

"""
GET = """\
  vrs get demo.vrst ws://127.0.0.1/robots/cell1
  vrs get pick.v2 ws://127.0.0.1 -o - | vrs check -

"""


def main(options: Namespace) -> int:
    """Put a file, or get one."""
    (_put if _puts(options.prog) else _get)(options)
    return 0


def _puts(prog: str) -> bool:
    return prog.endswith("put")


def parser(prog: str) -> Parser:
    if _puts(prog):
        return Parser(
            prog,
            "Put a file into the folder of a robot that is served.",
            PUT + EPILOG,
            option("file", metavar="FILE", type=Path, help="a program file, a trajectory, any other"),
            option("--as", dest="called", metavar="NAME", help="how it is called there (default: as here)"),
            option("--replace", action="store_true", help="a file of that name there is overwritten"),
            *URL,
        )
    return Parser(
        prog,
        "Get a file from the folder of a robot that is served.",
        GET + EPILOG,
        option("file", metavar="NAME", help="the file there"),
        option("-o", "--output", metavar="FILE", help="where to write it; - for standard output"),
        option("--replace", action="store_true", help="a file of that name here is overwritten"),
        *URL,
    )


def _put(options: Namespace) -> None:
    """Raises FileError, and what the robot refuses."""
    from vrs_cli.files.opening import unreadable
    from vrs_cli.net.messages import Put

    try:
        data = options.file.read_bytes()
    except OSError as error:
        raise unreadable(options.file, error) from None
    name = options.called or options.file.name
    ask_once(options, lambda id: Put(id, name, data, options.replace))


def _get(options: Namespace) -> None:
    """Raises FileError, and what the robot refuses. A file is written whole or not at all."""
    from vrs_cli.files.atomic import atomically
    from vrs_cli.net.messages import Fetched, Get

    path = Path(options.output or Path(options.file).name)
    if options.output != STANDARD_STREAM and path.exists() and not options.replace:
        raise FileExists(str(path), "--replace overwrites it, -o names another")

    def get(id: int) -> Request:
        return Get(id, options.file)

    fetched = ask_once(options, get)
    assert isinstance(fetched, Fetched), "it is what was asked for"
    if options.output == STANDARD_STREAM:
        sys.stdout.buffer.write(fetched.data)
        sys.stdout.buffer.flush()
        return
    with atomically(path) as stream:
        stream.write(fetched.data)
