"""What every subcommand shares that talks with a robot afar: its address, and who it is that asks."""

from __future__ import annotations

import argparse
import asyncio
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import CommandLineError, Parser, teller
from vrs_cli.errors import UsageError

if TYPE_CHECKING:
    from vrs_cli.net.client import Client
    from vrs_cli.net.messages import Request, ServerMessage

TOKEN = "VRS_TOKEN"
TOLD = re.compile(r"[\w.-]+ ([\w-]{32})")  # as `vrs token` tells one: NAME TOKEN
ADDRESS = "ws://HOST:PORT, ws://HOST:PORT/robots/NAME for one of several, or wss://"
EPILOG = f"A token is taken from --token-file, or from the environment variable {TOKEN}.\n"


def add_connection(parser: Parser, metavar: str = "URL", also: str = "", nargs: str | None = None) -> None:
    """The address, and the options of a connection. `also`: what else may stand in place of the address; `nargs`: "?"
    where that may be missing.
    """
    parser.add_argument("url", metavar=metavar, nargs=nargs, help=ADDRESS + also)
    group = parser.add_argument_group("the connection")
    group.add_argument("--token-file", metavar="FILE", help=f"a file with the token (default: {TOKEN})")
    group.add_argument("--name", default="", help="what others see you called, where tokens do not say that")
    group.add_argument("--ca", metavar="FILE", type=Path, help="the certificate of the server, or of who signed it")


def client_of(prog: str, options: argparse.Namespace, *, attended: bool = False, behind: float = 0.0) -> Client:
    """What connects, once it is opened; what becomes of the connection is told on stderr. Raises CommandLineError for
    what is no address, and for a file that cannot be read, FileError.
    """
    from vrs_cli.net.client import Client, hello_of

    hello = hello_of(token_of(options.token_file), name=options.name, behind=behind, attended=attended)
    try:
        return Client(options.url, hello, ca=options.ca, told=teller(prog))
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None


def ask_once(prog: str, options: argparse.Namespace, make: Callable[[int], Request]) -> ServerMessage:
    """Connect, ask for one thing, and leave; what the robot answers. Raises what it refuses."""

    async def once() -> ServerMessage:
        client = client_of(prog, options)
        try:
            await client.open()
            return await client.ask(make)
        finally:
            await client.close()

    return asyncio.run(once())


def token_of(file: str | None) -> str:
    """That of a file, which may hold it as `vrs token` told it. Raises CommandLineError."""
    if file is None:
        return os.environ.get(TOKEN, "")
    try:
        text = Path(file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeError) as error:
        raise CommandLineError(f"--token-file: {file} cannot be read", str(error)) from None
    told = TOLD.fullmatch(text)
    return told.group(1) if told else text
