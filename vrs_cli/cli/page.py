"""The page of `vrs view` and `vrs learn --view`: what is served to browsers of this machine, and at which address."""

from __future__ import annotations

import json
import os
import webbrowser
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING
from urllib.parse import quote

from vrs_cli.cli.command_line import CommandLineError, chosen_robot, teller
from vrs_cli.cli.remote import token_of
from vrs_cli.cli.sources import cell_file, read_recording, read_source, robot_of
from vrs_cli.errors import UsageError

if TYPE_CHECKING:
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.language.run.signals import Cell
    from vrs_cli.net.local_server import LocalRobot, PagePlace
    from vrs_cli.values.acts import Define

DATA = "?recording"  # of the address of a page: it shows data, and no robot


@contextmanager
def said_of_command_line() -> Iterator[None]:
    """Raise what is wrong with an option as CommandLineError."""
    try:
        yield
    except UsageError as error:
        raise CommandLineError(error.detail, error.hint) from None


def page_place(options: Namespace) -> PagePlace:
    """Return where the page of a command is to be: at its options `--host` and `--port`. At a port that was chosen the
    secret is that of the last time, so that a page that is still open goes on. Raises CommandLineError, and
    NonexistentFile if the page is not built.
    """
    from vrs_cli.net.http import ServedPage
    from vrs_cli.net.local_server import PagePlace, checked_host, kept_secret, new_secret
    from vrs_cli.net.server import ListenAddress
    from vrs_cli.repl.history import state_folder

    with said_of_command_line():
        address = ListenAddress(checked_host(options.host), options.port)
    secret = new_secret()
    with suppress(RuntimeError):  # there is no home
        if options.port:
            secret = kept_secret(state_folder(os.environ) / "view" / str(options.port))
    return PagePlace(address, secret, ServedPage.read())


def tell_page(options: Namespace, address: str) -> None:
    """Print the address of a page, and open it."""
    print(f"{options.prog}: {address}", flush=True)
    if not options.no_open:
        Thread(target=_opened, args=(address,), daemon=True).start()


def _opened(address: str) -> None:
    """Open a browser; without one the printed address is enough."""
    with suppress(webbrowser.Error):
        webbrowser.open(address)


# --- a new robot ------------------------------------------------------------------------------------------------------


def host_robot(
    options: Namespace, stack: ExitStack, at: PagePlace, model: RobotModel, cell: Cell | None, program: Define | None
) -> LocalRobot:
    """Serve a new robot with its page, until the stack is left. Raises what is wrong with the program."""
    from vrs_cli.net.local_server import LocalRobot
    from vrs_cli.render.text import styled_lines

    with said_of_command_line():
        local_robot = LocalRobot(
            model,
            at,
            rate=options.rate,
            folder=Path.cwd(),
            cell=cell,
            program=program,
            runs=not options.no_run,
            styled=styled_lines,
            tell=teller(options.prog),
        )
    stack.callback(local_robot.close)
    tell_page(options, local_robot.page(local_robot.name))
    return local_robot


def host_program(options: Namespace, stack: ExitStack, at: PagePlace, read: Callable[[str], Cell]) -> LocalRobot:
    """Serve a new robot with the programs of a file, and the cell around it; the first page executes the first of them.
    Raises FileError, and what is wrong with the file.
    """
    from vrs_cli.values.acts import Define

    source = read_source(options.url)
    found = cell_file(options, source)
    cell = None if found is None else read(found[0])
    if found is not None and options.cell is None:
        teller(options.prog)("the cell is {} ({})".format(*found))
    model = chosen_robot(options, robot_of(options.prog, source))
    return host_robot(options, stack, at, model, cell, Define(source.text, f"{source.path}:"))


# --- what others did, or do -------------------------------------------------------------------------------------------


def serve_recording(options: Namespace, stack: ExitStack, at: PagePlace, cell: Cell | None) -> None:
    """Serve a saved trajectory. Raises FileError."""
    from vrs_cli.net.local_server import LocalServer
    from vrs_cli.net.page_data import recorded_page

    recording = read_recording(options.prog, options.url, lenient=options.lenient)
    name = Path(options.url).name
    shown = recorded_page(recording.arm, recording.timeline, title=name, rate=options.rate, cell=cell)
    at.pages.add(f"/recording/{quote(name, safe='')}.json", "application/json", json.dumps(shown).encode())
    with said_of_command_line():
        server = LocalServer(at, tell=teller(options.prog))
    stack.callback(server.close)
    tell_page(options, server.page(name, DATA))


def relay_robot(options: Namespace, stack: ExitStack, at: PagePlace, cell: Cell | None) -> None:
    """Serve the page of a robot that is served elsewhere; in `cell` where its server tells none. Raises what it
    refuses.
    """
    from vrs_cli.net.client import hello_of
    from vrs_cli.net.local_server import BROWSER, LocalServer
    from vrs_cli.net.mirror import WINDOW
    from vrs_cli.net.relay import Relay
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.wire.cells import cell_record

    token, called = token_of(options.token_file), options.name or BROWSER
    with said_of_command_line():
        found = SocketPort.connect(options.url, hello_of(token, name=called), ca=options.ca, window=0.0)
    name, world = found.welcome.robot, found.far.world
    found.close()
    told = None if cell is None or world is not None else cell_record(cell)
    if cell is not None and told is None:
        why = "it is too large for a page" if world is None else "the server tells what is around the robot"
        teller(options.prog)(f"--cell is left out: {why}")
    window = None if options.window == WINDOW else options.window
    relay = Relay(
        options.url,
        name,
        at.secret,
        token=token,
        name=called,
        ca=options.ca,
        ahead=options.ahead,
        window=window,
        cell=told,
    )
    with said_of_command_line():
        server = LocalServer(at, relays={name: relay}, tell=teller(options.prog))
    stack.callback(server.close)
    tell_page(options, server.page(name))
