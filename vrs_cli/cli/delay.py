"""`vrs delay`: a line with delays between a client and a server."""

from __future__ import annotations

import argparse
import asyncio
from argparse import Namespace
from functools import partial
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import CommandLineError, command, option
from vrs_cli.cli.connections import KINDS, LINE_OPTIONS, signal_comes
from vrs_cli.repl.interrupt import ENDINGS, Ended

if TYPE_CHECKING:
    from vrs_cli.net.delay_proxy import Endpoint

LOOPBACK = "127.0.0.1"
LAST_PORT = 65535


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
Each connection has delays of its own, the same for the same seed and number. Ctrl-C ends it.

{KINDS}
  vrs serve --port 7000
  vrs delay 7001 7000 --forward "gamma 200ms 80ms" --backward "gamma 200ms 80ms" --loss 1%
  vrs connect ws://127.0.0.1:7001
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
