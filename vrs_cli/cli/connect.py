"""`vrs connect`: the shell at a robot that is served, on a terminal or on a pipe."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

from vrs_cli.cli.command_line import Parser, option
from vrs_cli.cli.connections import EPILOG, URL, client_of, duration

EXAMPLES = """\
  vrs connect ws://127.0.0.1/robots/cell1
  echo WHERE | vrs connect ws://127.0.0.1/robots/cell1

LOAD and STORE are about the files of the robot: vrs put and vrs get take files
there and back. What concerns the connection is told on stderr.

"""


def main(options: Namespace) -> int:
    """Hand over to the shell; returns its exit status. Raises what the robot refuses."""
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.repl.place import Afar
    from vrs_cli.repl.shell import at, on_terminal

    attended = on_terminal()
    client = client_of(options, attended=attended, behind=options.behind)
    client.told = once(client.told)
    port = SocketPort(client)
    try:
        if attended:
            client.told(f"{port.welcome.robot} at {client.url}; you are {port.name}, {port.welcome.role}")
        return at(Afar(port, client.told))
    finally:
        port.close()


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "The VAL-II shell at a robot that is served.",
        EXAMPLES + EPILOG,
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
    """The same, but for a text that was told just before: attempts to connect fail alike."""
    last = ""

    def tell(text: str) -> None:
        nonlocal last
        if text != last:
            told(text)
        last = text

    return tell
