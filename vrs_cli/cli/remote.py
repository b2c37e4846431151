"""Subcommands that use a network: `vrs connect` and `vrs lab delay`; and what others share with them: the options
of a robot's address, of the token and of delays, and the end by a signal.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import signal
import sys
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.cli.command_line import STANDARD_STREAM, CommandLineError, command, group, one_of, option, teller, whole
from vrs_cli.errors import FileExists, UsageError, VrsError
from vrs_cli.repl.interrupt import ENDINGS, SAID, Ended

if TYPE_CHECKING:
    from vrs_cli.net.client import Client
    from vrs_cli.net.delay_line import Delays
    from vrs_cli.net.delay_proxy import Endpoint
    from vrs_cli.net.messages import Request, ServerMessage


LOOPBACK = "127.0.0.1"
LAST_PORT = 65535
TOKEN = "VRS_TOKEN"
TOLD = re.compile(r"[\w.-]+ ([\w-]{32})")  # as `vrs class token` tells one: NAME TOKEN
T = TypeVar("T")
ADDRESS = "ws://HOST:PORT or ws://HOST:PORT/robots/NAME; wss:// too"
CONNECTION = group(
    "the connection",
    option("--token-file", metavar="FILE", help=f"a file with the token (default: {TOKEN})"),
    option("--name", rare=True, default="", help="what others see you called, where tokens do not say that"),
    option("--ca", rare=True, metavar="FILE", type=Path, help="the certificate of the server, or of who signed it"),
)
URL = (option("url", metavar="URL", help=ADDRESS), CONNECTION)


def client_of(options: Namespace, *, attended: bool = False, behind: float = 0.0) -> Client:
    """A client that is to be opened; news of its connection go to stderr. Raises CommandLineError for
    what is no address, and for a file that cannot be read, FileError.
    """
    from vrs_cli.net.client import Client, hello_of

    hello = hello_of(token_of(options.token_file), name=options.name, behind=behind, attended=attended)
    try:
        return Client(options.url, hello, ca=options.ca, told=teller(options.prog))
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None


def ask_once(options: Namespace, make: Callable[[int], Request]) -> ServerMessage:
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
    """Read a token from a file, alone or as `vrs class token` printed it; from the environment without one. Raises
    CommandLineError."""
    if file is None:
        return os.environ.get(TOKEN, "")
    try:
        text = Path(file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeError) as error:
        raise CommandLineError(f"--token-file: {file} cannot be read", str(error)) from None
    told = TOLD.fullmatch(text)
    return told.group(1) if told else text


# --- signals that end a subcommand which serves until then ------------------------------------------------------------


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


# --- how a line delays ------------------------------------------------------------------------------------------------

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
    option("--forward", rare=True, metavar="DELAYS", type=delays, help="on the way to the robot"),
    option("--backward", rare=True, metavar="DELAYS", type=delays, help="on the way back"),
    option("--loss", rare=True, metavar="SHARE", type=loss, default=0.0, help="what is lost on each way, as 1%%"),
    option("--seed", rare=True, metavar="N", type=whole, default=1, help="of all that is random (default: 1)"),
)


# --- vrs connect ------------------------------------------------------------------------------------------------------


def connect(options: Namespace) -> int:
    """Hand over to the shell, or put or get a file; returns the exit status. Raises what the robot refuses."""
    needed = {"called": "put", "output": "get"}
    wrong = next(
        (name for name, action in needed.items() if getattr(options, name) and not getattr(options, action)), ""
    )
    if wrong or (options.replace and not (options.put or options.get)):
        said = {"called": "--as is for --put", "output": "--output is for --get"}
        raise CommandLineError(said.get(wrong, "--replace is for --put and --get"), f"see {options.prog} --help")
    if options.put or options.get:
        (_put if options.put else _get)(options)
        return 0
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
  vrs connect ws://127.0.0.1 --put pick.v2 --as best.v2
\f

  echo WHERE | vrs connect ws://127.0.0.1/robots/cell1
  vrs connect ws://127.0.0.1 --get pick.v2 -o - | vrs check -

LOAD and STORE are about the files of the robot: --put and --get take files there and back.
What concerns the connection is told on stderr.
""",
    *URL,
    option(
        "--behind",
        rare=True,
        metavar="T",
        type=duration,
        default=0.0,
        help="a motion AT t begins T after t: what takes no longer to arrive is not too late",
    ),
    group(
        "files, instead of the shell",
        one_of(
            option("--put", metavar="FILE", type=Path, help="put a file into the robot's folder"),
            option("--get", metavar="NAME", help="get a file from there"),
        ),
        option("--as", dest="called", metavar="NAME", help="of --put: the name there (default: as here)"),
        option("-o", "--output", metavar="FILE", help="of --get: where to write it; - for standard output"),
        option("--replace", action="store_true", help="overwrite a file of that name"),
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


# --- vrs connect URL --put FILE, --get NAME ---------------------------------------------------------------------------


def _put(options: Namespace) -> None:
    """Put a file there. Raises FileError, and what the robot refuses."""
    from vrs_cli.files.opening import unreadable
    from vrs_cli.net.messages import Put

    try:
        data = options.put.read_bytes()
    except OSError as error:
        raise unreadable(options.put, error) from None
    name = options.called or options.put.name
    ask_once(options, lambda id: Put(id, name, data, options.replace))


def _get(options: Namespace) -> None:
    """Get a file, which is written whole or not at all. Raises FileError, and what the robot refuses."""
    from vrs_cli.files.atomic import atomically
    from vrs_cli.net.messages import Fetched, Get

    path = Path(options.output or Path(options.get).name)
    if options.output != STANDARD_STREAM and path.exists() and not options.replace:
        raise FileExists(str(path), "--replace overwrites it, -o names another")

    fetched = ask_once(options, lambda id: Get(id, options.get))
    assert isinstance(fetched, Fetched), "it is what was asked for"
    if options.output == STANDARD_STREAM:
        sys.stdout.buffer.write(fetched.data)
        sys.stdout.buffer.flush()
        return
    with atomically(path) as stream:
        stream.write(fetched.data)


# --- vrs lab delay ----------------------------------------------------------------------------------------------------


def delay(options: Namespace) -> None:
    """Serve until Ctrl-C."""
    number = asyncio.run(_serve(options))
    if number in ENDINGS:  # Ctrl-C is the way to stop it, any other signal ends the process
        raise Ended(number)


def _address(text: str) -> Endpoint:
    """HOST:PORT, [IPv6]:PORT, or PORT."""
    from vrs_cli.net.delay_proxy import Endpoint

    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdigit() and int(port) <= LAST_PORT) or "/" in host:
        raise argparse.ArgumentTypeError(f"{text!r} is no address, as {LOOPBACK}:7000 or 7000")
    return Endpoint(host.strip("[]") or LOOPBACK, int(port))


delay_parser = command(
    "Let a line between a client and a server be slow, uneven and lossy.",
    f"""\
Whoever connects to LISTEN is connected to TARGET; both are HOST:PORT, or a PORT of this machine (0: one that is free).
Ctrl-C ends it.

  vrs lab delay 7001 7000 --forward "gamma 200ms 80ms" --loss 1%
  vrs connect ws://127.0.0.1:7001
\f

{KINDS}
Each connection has delays of its own, the same for the same seed and number.
""",
    option("listen", metavar="LISTEN", type=_address, help="where clients connect"),
    option("target", metavar="TARGET", type=_address, help="the server"),
    *LINE_OPTIONS,
    option("--quiet", action="store_true", help="tell of no connections"),
)


async def _serve(options: Namespace) -> int:
    """Serve until a signal comes; return its number. Raises CommandLineError where nobody can listen there."""
    from vrs_cli.net.delay_line import Constant, DelayWays, with_loss
    from vrs_cli.net.delay_proxy import DelayProxy

    none, tell = ("0", Constant(0.0)), partial(print, flush=True)
    (there, forward), (back, backward) = (way or none for way in (options.forward, options.backward))
    ways = DelayWays(with_loss(forward, options.loss), with_loss(backward, options.loss), options.seed)
    proxy = DelayProxy(options.target, ways, (lambda _text: None) if options.quiet else tell)
    try:
        at = await proxy.listen(options.listen)
    except OSError as error:
        raise CommandLineError(f"{options.listen} cannot be listened at: {error.strerror}") from None
    lost = f", loss {options.loss:.1%}" if options.loss else ""
    tell(f"{at} -> {options.target}: forward {there}, backward {back}{lost}; Ctrl-C ends it")
    try:
        return await signal_comes()
    finally:
        await proxy.close()
