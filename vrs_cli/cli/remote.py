"""Carry out `vrs connect` and `vrs lab delay`. Also create the clients, and read the tokens, of other subcommands."""

from __future__ import annotations

import asyncio
import os
import re
import sys
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path

from vrs_cli.cli.command_line import CommandLineError, errors_of_options, refuse, teller
from vrs_cli.cli.commands import STANDARD_STREAM
from vrs_cli.errors import FileExists, UsageError
from vrs_cli.files import atomic, opening
from vrs_cli.net import delay_line, messages, socket_port
from vrs_cli.net.client import Client, hello_of
from vrs_cli.repl import connection, interrupt
from vrs_cli.repl.shell import at, on_terminal

TOKEN = "VRS_TOKEN"
TOKEN_LINE = re.compile(r"[\w.-]+ ([\w-]{32})")  # a line as `vrs class token` prints it: NAME TOKEN


def client_of(options: Namespace, *, attended: bool = False, behind: float = 0.0) -> Client:
    """Return a client that is not open yet. Messages about its connection go to standard error. Raises CommandLineError
    for a wrong address, or FileError."""
    hello = hello_of(token_of(options.token_file), name=options.name, behind=behind, attended=attended)
    with errors_of_options(UsageError):
        return Client(options.url, hello, ca=options.ca, notify=teller(options.prog))


def ask_once(options: Namespace, make: Callable[[int], messages.Request]) -> messages.ServerMessage:
    """Connect, send one request, and disconnect; return the answer. Raises an error if the robot refuses the
    request."""

    async def once() -> messages.ServerMessage:
        client = client_of(options)
        try:
            await client.open()
            return await client.ask(make)
        finally:
            await client.close()

    return asyncio.run(once())


def token_of(file: str | None) -> str:
    """Return the token in a file, which contains the token alone or as `vrs class token` prints it. If no file is
    given, return the token in the environment variable VRS_TOKEN. Raises CommandLineError if the file cannot be
    read."""
    if file is None:
        return os.environ.get(TOKEN, "")
    try:
        text = Path(file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeError) as error:
        raise CommandLineError(f"--token-file: {file} cannot be read", str(error)) from None
    match = TOKEN_LINE.fullmatch(text)
    return match.group(1) if match else text


# --- vrs connect ------------------------------------------------------------------------------------------------------


def connect(options: Namespace) -> int:
    """Run the shell with a served robot, or copy a file to or from the robot's folder; return the exit status. Raises
    an error if the robot refuses a request."""
    see = f"see {options.prog} --help"
    refuse(
        (options.called and not options.put, "--as is for --put", see),
        (options.output and not options.get, "--output is for --get", see),
        (options.replace and not (options.put or options.get), "--replace is for --put and --get", see),
    )
    if options.put or options.get:
        (_put if options.put else _get)(options)
        return 0

    attended = on_terminal()
    client = client_of(options, attended=attended, behind=options.behind)
    client.notify = once(client.notify)
    port = socket_port.SocketPort(client)
    try:
        if attended:
            client.notify(f"{port.welcome.robot} at {client.url}; you are {port.name}, {port.welcome.role}")
        return at(connection.Remote(port, client.notify))
    finally:
        port.close()


def once(notify: Callable[[str], None]) -> Callable[[str], None]:
    """Return a function that reports messages through `notify`, but skips a message equal to the previous one: repeated
    attempts to connect fail with the same message."""
    last = ""

    def tell(text: str) -> None:
        nonlocal last
        if text != last:
            notify(text)
        last = text

    return tell


# --- vrs connect URL --put FILE, --get NAME ---------------------------------------------------------------------------


def _put(options: Namespace) -> None:
    """Copy a local file into the robot's folder. Raises FileError, or an error if the robot refuses it."""
    try:
        data = options.put.read_bytes()
    except OSError as error:
        raise opening.unreadable(options.put, error) from None
    ask_once(options, lambda id: messages.Put(id, options.called or options.put.name, data, options.replace))


def _get(options: Namespace) -> None:
    """Copy a file from the robot's folder. The local file is written completely or not at all. Raises FileError, or an
    error if the robot refuses it."""
    path = Path(options.output or Path(options.get).name)
    if options.output != STANDARD_STREAM and path.exists() and not options.replace:
        raise FileExists(str(path), "--replace overwrites it, -o names another")

    fetched = ask_once(options, lambda id: messages.Get(id, options.get))
    assert isinstance(fetched, messages.Fetched), "it is what was asked for"
    if options.output == STANDARD_STREAM:
        sys.stdout.buffer.write(fetched.data)
        sys.stdout.buffer.flush()
        return
    with atomic.atomically(path) as stream:
        stream.write(fetched.data)


# --- vrs lab delay ----------------------------------------------------------------------------------------------------


def delay(options: Namespace) -> None:
    """Run a proxy that delays all messages, until Ctrl-C."""
    number = asyncio.run(_serve(options))
    if number in interrupt.ENDINGS:  # Ctrl-C only stops the proxy; other signals end the process
        raise interrupt.Ended(number)


async def _serve(options: Namespace) -> int:
    """Run the proxy until a signal arrives; return its number. Raises CommandLineError if the address cannot be
    used."""
    none, tell = ("0", delay_line.Constant(0.0)), partial(print, flush=True)
    (there, forward), (back, backward) = (way or none for way in (options.forward, options.backward))
    ways = delay_line.DelayWays(
        delay_line.with_loss(forward, options.loss), delay_line.with_loss(backward, options.loss), options.seed
    )
    proxy = delay_line.DelayProxy(options.target, ways, (lambda _text: None) if options.quiet else tell)
    try:
        at = await proxy.listen(options.listen)
    except OSError as error:
        raise CommandLineError(f"{options.listen} cannot be listened at: {error.strerror}") from None
    lost = f", loss {options.loss:.1%}" if options.loss else ""
    tell(f"{at} -> {options.target}: forward {there}, backward {back}{lost}; Ctrl-C ends it")
    try:
        return await interrupt.signal_comes()
    finally:
        await proxy.close()
