"""`vrs view` in a browser: what is shown there, and how long."""

from __future__ import annotations

import argparse
import asyncio
import os
import webbrowser
from collections.abc import Callable
from contextlib import ExitStack, suppress
from importlib.util import find_spec
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import CommandLineError, chosen_robot, teller
from vrs_cli.cli.connections import signal_comes, token_of
from vrs_cli.cli.sources import is_program, is_recording, read_recording, read_source, robot_of
from vrs_cli.errors import UsageError
from vrs_cli.extras import how_to_install

if TYPE_CHECKING:
    from vrs_cli.engine.position import Watched
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.view3d.door import Door
    from vrs_cli.view3d.hosted import Hosted
    from vrs_cli.view3d.window import RobotWindow

Told = Callable[[str], None]
Hold = Callable[[Told], "SocketPort | Watched"]
First = Callable[["RobotWindow"], None]


def show(options: argparse.Namespace) -> int:
    """Until a signal ends it, or the user of the shell beside it; returns the exit status. Raises VrsError."""
    if find_spec("viser") is None:
        raise CommandLineError("a view in the browser needs viser", how_to_install("viser"))
    first: First = nothing
    with ExitStack() as stack:
        if not options.url:
            return _with_shell(options, stack)
        if is_recording(options.url):
            hold = _recorded(options)
        elif is_program(options.url):
            hold, first = _program(options, stack)
        else:
            hold = _afar(options)
        _open(options, stack, _door(options), hold, first)
        asyncio.run(signal_comes())
    return 0


def nothing(_window: RobotWindow) -> None:
    """Nothing is to be done."""


def _door(options: argparse.Namespace) -> Door:
    """The page has an address, and a browser is on its way to it: what answers it is loaded meanwhile."""
    from vrs_cli.view3d.door import opened

    try:
        door = opened(options.host, options.port, _secret(options.port))
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None
    print(f"{options.prog}: {door.address}", flush=True)
    if not options.no_open:
        Thread(target=_opened, args=(door.address,), daemon=True).start()
    return door


def _open(options: argparse.Namespace, stack: ExitStack, door: Door, hold: Hold, first: First = nothing) -> None:
    """The page is there, until the stack is left."""
    from vrs_cli.view3d.app import App

    title = Path(options.url).name if is_recording(options.url or "") else ""
    app = App(hold, door=door, title=title, rate=options.rate, first=first, tell=teller(options.prog))
    stack.callback(app.close)


def _secret(port: int) -> str:
    """At a port that was chosen, that of the last time: a page that is still there goes on."""
    from vrs_cli.repl.history import state_folder
    from vrs_cli.view3d.door import kept_secret

    with suppress(RuntimeError):  # there is no home
        return kept_secret(state_folder(os.environ) / "view" / str(port)) if port else ""
    return ""


def _opened(address: str) -> None:
    """Where there is no browser the address is enough."""
    with suppress(webbrowser.Error):
        webbrowser.open(address)


# --- what is watched -------------------------------------------------------------------------------------------------


def _recorded(options: argparse.Namespace) -> Hold:
    """Raises FileError."""
    recording = read_recording(options.prog, options.url, lenient=options.lenient)
    from vrs_cli.interfaces.roles.observer import RecordedRobot

    recorded = RecordedRobot(recording.arm, recording.timeline)
    return lambda _told: recorded


def _afar(options: argparse.Namespace) -> Hold:
    """A robot that is served, which is there. Raises what it refuses."""
    from vrs_cli.net.client import hello_of
    from vrs_cli.net.socket_port import SocketPort

    hello = hello_of(token_of(options.token_file), name=options.name or "browser", attended=True)

    def hold(told: Told) -> SocketPort:
        robot = SocketPort.connect(options.url, hello, ca=options.ca, told=told, window=options.window)
        robot.far.ahead = options.ahead
        return robot

    try:
        SocketPort.connect(options.url, hello, ca=options.ca, window=0.0).close()
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None
    return hold


def _hosted(options: argparse.Namespace, stack: ExitStack, model: RobotModel) -> Hosted:
    """A new robot, in real time."""
    from vrs_cli.view3d.hosted import Hosted

    hosted = Hosted(model, rate=options.rate, folder=Path.cwd(), tell=teller(options.prog))
    stack.callback(hosted.close)
    return hosted


def _program(options: argparse.Namespace, stack: ExitStack) -> tuple[Hold, First]:
    """A new robot with the programs of a file; the first browser executes the first of them. Raises FileError, and what
    is wrong with the file.
    """
    from vrs_cli.interfaces.roles.supervisor import Supervisor
    from vrs_cli.view3d.hosted import SHELL

    source = read_source(options.url)
    hosted = _hosted(options, stack, chosen_robot(options, robot_of(options.prog, source)))
    loading = Supervisor(hosted.hold(SHELL))
    try:
        names = loading.define(source.text, f"{source.path}:")
    finally:
        loading.close()

    def execute(window: RobotWindow) -> None:
        window.type(f"EXECUTE {names[0]}")

    return hosted.hold_for_browser, execute if names and not options.no_run else nothing


def _with_shell(options: argparse.Namespace, stack: ExitStack) -> int:
    """A new robot, and the shell at it; on a pipe, the page stays when the lines are done."""
    model = chosen_robot(options)
    door = _door(options)
    hosted = _hosted(options, stack, model)
    _open(options, stack, door, hosted.hold_for_browser)
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.repl.place import Remote
    from vrs_cli.repl.shell import at, on_terminal

    connection = SocketPort(hosted.client(attended=on_terminal()))
    stack.callback(connection.close)
    status = at(Remote(connection, teller(options.prog)))
    if not on_terminal():
        asyncio.run(signal_comes())
    return status
