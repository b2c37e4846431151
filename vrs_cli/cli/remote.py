"""Subcommands about a robot that is served: `vrs connect`, `put` and `get`."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path

from vrs_cli.cli.command_line import STANDARD_STREAM, command, option
from vrs_cli.cli.connections import EPILOG, URL, ask_once, client_of, duration
from vrs_cli.errors import FileExists


def connect(options: Namespace) -> int:
    """Hand over to the shell; returns its exit status. Raises what the robot refuses."""
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.repl.connection import Remote
    from vrs_cli.repl.shell import at, on_terminal

    attended = on_terminal()
    client = client_of(options, attended=attended, behind=options.behind)
    client.told = once(client.told)
    port = SocketPort(client)
    try:
        if attended:
            client.told(f"{port.welcome.robot} at {client.url}; you are {port.name}, {port.welcome.role}")
        return at(Remote(port, client.told))
    finally:
        port.close()


connect_parser = command(
    "The VAL-II shell at a robot that is served.",
    """\
  vrs connect ws://127.0.0.1/robots/cell1
  echo WHERE | vrs connect ws://127.0.0.1/robots/cell1

LOAD and STORE are about the files of the robot: vrs put and vrs get take files
there and back. What concerns the connection is told on stderr.

"""
    + EPILOG,
    *URL,
    option(
        "--behind",
        metavar="T",
        type=duration,
        default=0.0,
        help="a motion AT t begins T after t: what takes no longer to arrive is not too late",
    ),
)


def once(told: Callable[[str], None]) -> Callable[[str], None]:
    """Return a teller that leaves out a text equal to the one before: failed attempts to connect repeat theirs."""
    last = ""

    def tell(text: str) -> None:
        nonlocal last
        if text != last:
            told(text)
        last = text

    return tell


# --- vrs transfer ---------------------------------------------------------------------------------------------------


put_parser = command(
    "Put a file into the folder of a robot that is served.",
    """\
  vrs put pick.v2 ws://127.0.0.1/robots/cell1
  vrs put pick.v2 ws://127.0.0.1 --as best.v2 --replace

"""
    + EPILOG,
    option("file", metavar="FILE", type=Path, help="a program file, a trajectory, any other"),
    option("--as", dest="called", metavar="NAME", help="how it is called there (default: as here)"),
    option("--replace", action="store_true", help="a file of that name there is overwritten"),
    *URL,
)


get_parser = command(
    "Get a file from the folder of a robot that is served.",
    """\
  vrs get demo.vrst ws://127.0.0.1/robots/cell1
  vrs get pick.v2 ws://127.0.0.1 -o - | vrs check -

"""
    + EPILOG,
    option("file", metavar="NAME", help="the file there"),
    option("-o", "--output", metavar="FILE", help="where to write it; - for standard output"),
    option("--replace", action="store_true", help="a file of that name here is overwritten"),
    *URL,
)


def put(options: Namespace) -> None:
    """Put a file there. Raises FileError, and what the robot refuses."""
    from vrs_cli.files.opening import unreadable
    from vrs_cli.net.messages import Put

    try:
        data = options.file.read_bytes()
    except OSError as error:
        raise unreadable(options.file, error) from None
    name = options.called or options.file.name
    ask_once(options, lambda id: Put(id, name, data, options.replace))


def get(options: Namespace) -> None:
    """Get a file, which is written whole or not at all. Raises FileError, and what the robot refuses."""
    from vrs_cli.files.atomic import atomically
    from vrs_cli.net.messages import Fetched, Get

    path = Path(options.output or Path(options.file).name)
    if options.output != STANDARD_STREAM and path.exists() and not options.replace:
        raise FileExists(str(path), "--replace overwrites it, -o names another")

    fetched = ask_once(options, lambda id: Get(id, options.file))
    assert isinstance(fetched, Fetched), "it is what was asked for"
    if options.output == STANDARD_STREAM:
        sys.stdout.buffer.write(fetched.data)
        sys.stdout.buffer.flush()
        return
    with atomically(path) as stream:
        stream.write(fetched.data)
