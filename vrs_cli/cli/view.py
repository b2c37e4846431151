"""Carry out `vrs view` and `vrs demo`: watch and drive a robot in a browser or on the terminal, or watch a saved
trajectory."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import webbrowser
from argparse import Namespace
from contextlib import ExitStack, suppress
from math import inf
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING
from urllib.parse import quote

from vrs_cli.cli import remote, run
from vrs_cli.cli.command_line import Parser, chosen_robot, clock_of, errors_of_options, refuse, teller
from vrs_cli.cli.sources import cell_file, is_program, is_recording, read_recording, read_source, robot_of
from vrs_cli.errors import NonexistentFile, UsageError, VrsError
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import Cell
from vrs_cli.net import far_end, http, messages, page_data, socket_port
from vrs_cli.net.client import hello_of
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.relay import Relay
from vrs_cli.net.server import ListenAddress
from vrs_cli.render.text import plain_text, styled_lines
from vrs_cli.repl import config, interrupt, player
from vrs_cli.repl.connection import Remote
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.shell import Local, at, on_terminal
from vrs_cli.values.acts import Define
from vrs_cli.wire.cells import cell_record
from vrs_cli.world.course import World

if TYPE_CHECKING:
    from vrs_cli.net.local_server import LocalRobot, PagePlace


def view(options: Namespace) -> int:
    """Show a robot or a saved trajectory until the user leaves; return the exit status."""
    if not options.terminal:
        return show(options)
    refuse(
        (not on_terminal(), "this is no terminal", "vrs where and vrs replay tell of a saved trajectory in a pipe"),
        (not options.url, "--terminal shows a robot that is served, or a saved trajectory", "name one"),
    )
    if is_recording(options.url):
        recording = read_recording(options.prog, options.url, lenient=options.lenient)
        player.play(recording.arm, recording.timeline, options.rate, _world(options, recording.arm))
    else:
        asyncio.run(_watch(options))
    return 0


def _world(options: Namespace, arm: RobotArm) -> World | None:
    """Return the world (parts and fixtures over time) of the cell file --cell, for pictures on the terminal. Raises
    FileError."""
    return None if options.cell is None else World(arm, read_cell(options.cell))


async def _watch(options: Namespace) -> None:
    """Watch a served robot on the terminal. Raises RequestRefused, or the server's error if it refuses the
    connection."""
    client = remote.client_of(options)
    news, predicted = News(), far_end.Predicted(client.far)
    client.far.ahead = far_end.Ahead.PRESENT if options.ahead is None else options.ahead
    client.notify = news.cut

    def abort() -> None:
        try:
            client.begin(messages.Abort, news.keep_answer)
        except VrsError as error:
            news.cut(f"ABORT is not sent: {error}")

    client.far.news.append(news.hear)
    try:
        await client.open()
        mirror = await client.follow((options.window or WINDOW) if options.cell is None else inf)

        def lines(t: float) -> str:
            return "\n".join(line for line in (news.line(), *client.far.preview_now().lines(t)) if line)

        world = client.far.world or _world(options, predicted.arm)
        await player.watch(predicted, lines, lambda: mirror.clock.rate is not None, abort, world)
    finally:
        await client.close()


class News:
    """A one-line summary of a robot's state: who drives it, which programs run, and whether it is connected."""

    def __init__(self) -> None:
        self._activity = self._cut = self._said = ""

    def hear(self, message: messages.ServerMessage) -> None:
        match message:
            case messages.Activity(driver, programs):
                runs = f"{', '.join(programs) or 'no program'} {'run' if len(programs) > 1 else 'runs'}"
                self._activity = f"{driver or 'nobody'} drives; {runs}"
                self._said = "" if programs else self._said
            case messages.Welcome():
                self._cut = ""

    def cut(self, why: str) -> None:
        self._cut = why

    def keep_answer(self, message: messages.ServerMessage) -> None:
        """Keep the answer to ABORT, so that it can be shown."""
        match message:
            case messages.Told(reply):
                self._said = plain_text(reply).strip()
            case messages.Done(refusal=refusal) if refusal is not None:
                self._said = str(refusal.error())

    def line(self) -> str:
        return "; ".join(filter(None, (self._cut or self._activity, self._said)))


# --- in a browser ---------------------------------------------------------------------------------------------------


def show(options: Namespace) -> int:
    """Serve the page until a signal arrives, or until the user leaves the shell that runs with the page; return the
    exit status. Raises VrsError."""
    at_page, url = page_place(options), options.url or ""
    cell = None if is_program(url) or options.cell is None else read_cell(options.cell)
    with ExitStack() as stack:
        if is_program(url):
            host_program(options, stack, at_page)
        elif is_recording(url):
            serve_recording(options, stack, at_page, cell)
        elif url:
            relay_robot(options, stack, at_page, cell)
        else:
            return run_beside(options, stack, host_robot(options, stack, at_page, chosen_robot(options), cell, None))
        asyncio.run(interrupt.signal_comes())
    return 0


def run_beside(options: argparse.Namespace, stack: ExitStack, local_robot: LocalRobot) -> int:
    """Run the shell for the robot that the page shows; return the exit status. On a pipe, serve the page after the last
    line until a signal arrives."""
    connection = socket_port.SocketPort(local_robot.client(attended=on_terminal()))
    stack.callback(connection.close)
    status = at(Remote(connection, teller(options.prog)))
    if not on_terminal():
        asyncio.run(interrupt.signal_comes())
    return status


def page_place(options: Namespace) -> PagePlace:
    """Return the address and the secret of a page, from the options `--host` and `--port`. For a port that the user has
    chosen, the secret is stored and used again, so that an open page stays valid. Raises CommandLineError, or
    NonexistentFile if the page is not built."""
    from vrs_cli.net.local_server import PagePlace, checked_host, kept_secret, new_secret

    with errors_of_options(UsageError):
        address = ListenAddress(checked_host(options.host), options.port)
    secret = new_secret()
    with suppress(RuntimeError):  # there is no home folder
        if options.port:
            secret = kept_secret(config.state_folder(os.environ) / "view" / str(options.port))
    return PagePlace(address, secret, http.ServedPage.read())


def tell_page(options: Namespace, address: str) -> None:
    """Print the address of a page, and open the page in a browser."""
    print(f"{options.prog}: {address}", flush=True)
    if not options.no_open:
        Thread(target=_open_browser, args=(address,), daemon=True).start()


def _open_browser(address: str) -> None:
    """Open the page in a browser. If there is no browser, do nothing, because the address was printed."""
    with suppress(webbrowser.Error):
        webbrowser.open(address)


# --- a new robot ------------------------------------------------------------------------------------------------------


def host_robot(
    options: Namespace, stack: ExitStack, at: PagePlace, model: RobotModel, cell: Cell | None, program: Define | None
) -> LocalRobot:
    """Serve a new robot and its page until the caller's ExitStack (`stack`) is closed. Raises the errors of the
    program."""
    from vrs_cli.net.local_server import LocalRobot

    with errors_of_options(UsageError):
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


def host_program(options: Namespace, stack: ExitStack, at: PagePlace) -> LocalRobot:
    """Serve a new robot with the programs of a file and its cell. The first program starts when the first page
    connects. Raises FileError, and the errors of the file."""
    source = read_source(options.url)
    found = cell_file(options, source)
    cell = None if found is None else read_cell(found[0])
    if found is not None and options.cell is None:
        teller(options.prog)("the cell is {} ({})".format(*found))
    model = chosen_robot(options, robot_of(options.prog, source))
    return host_robot(options, stack, at, model, cell, Define(source.text, f"{source.path}:"))


# --- saved trajectories, and robots on other servers ------------------------------------------------------------------


def serve_recording(options: Namespace, stack: ExitStack, at: PagePlace, cell: Cell | None) -> None:
    """Serve a page with a saved trajectory until `stack` is closed. Raises FileError."""
    from vrs_cli.net.local_server import LocalServer

    recording = read_recording(options.prog, options.url, lenient=options.lenient)
    name = Path(options.url).name
    shown = page_data.recorded_page(recording.arm, recording.timeline, title=name, rate=options.rate, cell=cell)
    at.pages.add(f"/recording/{quote(name, safe='')}.json", "application/json", json.dumps(shown).encode())
    with errors_of_options(UsageError):
        server = LocalServer(at, tell=teller(options.prog))
    stack.callback(server.close)
    tell_page(options, server.page(name, "?recording"))


def relay_robot(options: Namespace, stack: ExitStack, at: PagePlace, cell: Cell | None) -> None:
    """Serve a page that shows a robot on another server, until `stack` is closed. `cell`: the cell to show if that
    server has none for the robot. Raises the server's error if it refuses the connection."""
    from vrs_cli.net.local_server import BROWSER, LocalServer

    token, called = remote.token_of(options.token_file), options.name or BROWSER
    with errors_of_options(UsageError):
        found = socket_port.SocketPort.connect(options.url, hello_of(token, name=called), ca=options.ca, window=0.0)
    name, world = found.welcome.robot, found.far.world
    found.close()
    record = None if cell is None or world is not None else cell_record(cell)
    if cell is not None and record is None:
        why = "it is too large for a page" if world is None else "the server tells what is around the robot"
        teller(options.prog)(f"--cell is left out: {why}")
    relay = Relay(
        options.url,
        name,
        at.secret,
        token=token,
        name=called,
        ca=options.ca,
        ahead=far_end.Ahead.PRESENT if options.ahead is None else options.ahead,
        window=options.window,
        cell=record,
    )
    with errors_of_options(UsageError):
        server = LocalServer(at, relays={name: relay}, tell=teller(options.prog))
    stack.callback(server.close)
    tell_page(options, server.page(name))


SAMPLE, PROGRAM = "pick_and_place.v2", "pick.and.place"
TRY = """\
Try these lines:

  MOVE #PPOINT(30, -60, 120, 0, 0, 0)
  WHERE AT 1.5
  HELP TUTORIAL
"""


def demo(options: Namespace) -> int:
    """Show the sample program, and run the shell until the user leaves; return the exit status.

    If there is no terminal, run the program as `vrs run` does. Raises VrsError.
    """
    if not on_terminal():
        return run.run(Parser("run", options.prog).parse([SAMPLE]))
    if options.terminal or not (options.no_open or has_browser()):
        return _on_terminal()

    arguments = [SAMPLE, "--no-open"] if options.no_open else [SAMPLE]
    shown = Parser("view", options.prog).parse(arguments)
    with ExitStack() as stack:
        try:
            place = page_place(shown)
        except NonexistentFile as error:  # the page is not built
            print(f"{options.prog}: {error}")
            return _on_terminal()
        local_robot = host_program(shown, stack, place)
        print(TRY)
        return run_beside(shown, stack, local_robot)


def has_browser() -> bool:
    """Return whether the page would open in its own window; browsers that run in the terminal cannot show it."""
    try:
        found = webbrowser.get()
    except webbrowser.Error:
        return False
    return "BROWSER" in os.environ or type(found) is not webbrowser.GenericBrowser


class DemoPlace(Local):
    """A robot in this process, whose shell starts with lines that the demo enters for the user."""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        front_end = super().front_end(terminal)
        load_sample = front_end.opening

        def begin() -> None:
            load_sample()
            for line in (f"EXECUTE {PROGRAM}", "SHOW"):
                print(f".{line}")
                front_end.take(line)
            print(TRY)

        front_end.opening = begin
        return front_end


def _on_terminal() -> int:
    sample = Path(shipped_folder("programs"), SAMPLE)
    return at(DemoPlace(file=str(sample), clock=clock_of(1.0), cell=str(sample.with_suffix(".toml"))))
