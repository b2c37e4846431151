"""Options of subcommands that use a network: a robot's address, the token, delays; and the end by a signal."""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.cli.command_line import CommandLineError, group, option, teller, whole
from vrs_cli.errors import UsageError, VrsError
from vrs_cli.repl.interrupt import SAID

if TYPE_CHECKING:
    from vrs_cli.net.client import Client
    from vrs_cli.net.delay_line import Delays
    from vrs_cli.net.messages import Request, ServerMessage


TOKEN = "VRS_TOKEN"
TOLD = re.compile(r"[\w.-]+ ([\w-]{32})")  # as `vrs token` tells one: NAME TOKEN
T = TypeVar("T")
ADDRESS = "ws://HOST:PORT, ws://HOST:PORT/robots/NAME for one of several, or wss://"
EPILOG = f"A token is taken from --token-file, or from the environment variable {TOKEN}.\n"
CONNECTION = group(
    "the connection",
    option("--token-file", metavar="FILE", help=f"a file with the token (default: {TOKEN})"),
    option("--name", default="", help="what others see you called, where tokens do not say that"),
    option("--ca", metavar="FILE", type=Path, help="the certificate of the server, or of who signed it"),
)
URL = (option("url", metavar="URL", help=ADDRESS), CONNECTION)


def client_of(options: argparse.Namespace, *, attended: bool = False, behind: float = 0.0) -> Client:
    """A client that is to be opened; news of its connection go to stderr. Raises CommandLineError for
    what is no address, and for a file that cannot be read, FileError.
    """
    from vrs_cli.net.client import Client, hello_of

    hello = hello_of(token_of(options.token_file), name=options.name, behind=behind, attended=attended)
    try:
        return Client(options.url, hello, ca=options.ca, told=teller(options.prog))
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None


def ask_once(options: argparse.Namespace, make: Callable[[int], Request]) -> ServerMessage:
    """Connect, ask for one thing, and leave; what the robot answers. Raises what it refuses."""

    async def once() -> ServerMessage:
        client = client_of(options)
        try:
            await client.open()
            return await client.ask(make)
        finally:
            await client.close()

    return asyncio.run(once())


def token_of(file: str | None) -> str:
    """Read a token from a file, alone or as `vrs token` printed it; from the environment without one. Raises
    CommandLineError."""
    if file is None:
        return os.environ.get(TOKEN, "")
    try:
        text = Path(file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeError) as error:
        raise CommandLineError(f"--token-file: {file} cannot be read", str(error)) from None
    told = TOLD.fullmatch(text)
    return told.group(1) if told else text


# --- how a line delays ----------------------------------------------------------------------------------------------

KINDS = """\
DELAYS is one of
  200ms                        always the same
  normal 200ms 40ms            mean and standard deviation
  gamma 200ms 80ms             mean and standard deviation
  bursty 50ms 400ms 5s 500ms   the delay in calm and in a burst, and how long each lasts on average
  trace FILE                   as measured: a line is a delay, or a time [s] and a delay
A number without a unit is in seconds. Order is kept; what is lost is sent again after 0.2 s, 0.4 s, ...
"""


def _read(parse: Callable[[str], T], text: str) -> T:
    """Raises ArgumentTypeError, to which argparse adds the option."""
    try:
        return parse(text)
    except VrsError as error:
        raise argparse.ArgumentTypeError(f"{error.detail}; {error.hint}" if error.hint else error.detail) from None


def delays(text: str) -> tuple[str, Delays]:
    """Delays, with the text that says them."""
    from vrs_cli.net.delay_line import parse_delays

    return text, _read(parse_delays, text)


def duration(text: str) -> float:
    """A time [s]: 200ms, 0.2s, 0.2."""
    from vrs_cli.net.delay_line import parse_duration

    return _read(parse_duration, text)


def loss(text: str) -> float:
    """A share: 1%, 0.01."""
    from vrs_cli.net.delay_line import parse_loss

    return _read(parse_loss, text)


LINE_OPTIONS = (
    option("--forward", metavar="DELAYS", type=delays, help="on the way to the robot"),
    option("--backward", metavar="DELAYS", type=delays, help="on the way back"),
    option("--loss", metavar="SHARE", type=loss, default=0.0, help="what is lost on each way, as 1%%"),
    option("--seed", metavar="N", type=whole, default=1, help="of all that is random (default: 1)"),
)


# --- signals that end a subcommand which serves until then ---------------------------------------------------------


async def signal_comes() -> int:
    """Wait for Ctrl-C, or a signal that ends the process; its number. Signals that are ignored stay ignored.

    The event loop hears them: a handler of Python's own may not run before something else wakes the loop.
    """
    loop, came = asyncio.get_running_loop(), asyncio.Queue[int]()
    heard = [number for number in SAID if signal.getsignal(number) is not signal.SIG_IGN]
    try:
        for number in heard:
            loop.add_signal_handler(number, came.put_nowait, number)
    except NotImplementedError:  # Windows: Ctrl-C raises KeyboardInterrupt
        heard = []
    try:
        return await came.get()
    finally:
        for number in heard:
            loop.remove_signal_handler(number)
