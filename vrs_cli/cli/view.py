"""`vrs view`: watch and drive a robot in a browser, or watch one on the terminal; or a saved trajectory."""

from __future__ import annotations

import argparse
import asyncio
from argparse import Namespace
from contextlib import ExitStack
from math import inf
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import (
    ROBOT,
    CommandLineError,
    Parser,
    chosen_robot,
    clock_rate,
    group,
    option,
    positive,
    teller,
)
from vrs_cli.cli.remote import ADDRESS, CONNECTION, client_of, duration, signal_comes
from vrs_cli.cli.serve import port
from vrs_cli.cli.sources import LENIENT, is_program, is_recording, read_recording
from vrs_cli.repl.shell import on_terminal

if TYPE_CHECKING:
    from vrs_cli.kinematics.arm import RobotArm
    from vrs_cli.language.run.signals import Cell
    from vrs_cli.net.client import Client
    from vrs_cli.net.far_end import Ahead
    from vrs_cli.net.local_server import LocalRobot
    from vrs_cli.net.messages import ServerMessage
    from vrs_cli.world.world import World


CELL_HELP = "what is around it (see docs/cell.md)"
EPILOG = """\
  vrs view
  vrs view pick.v2 --rate 0.5
  vrs view ws://127.0.0.1:8765

The page is for this machine alone. Ctrl-C, or SIGTERM, ends it (in the shell: EXIT).

\f
On the terminal: space plays and pauses, left and right seek, r rewinds, f follows
the robot again, + and - change the rate, Ctrl-X aborts what others have it do, q leaves.

  vrs view --terminal ws://127.0.0.1:8765
  vrs view --terminal --ahead auto ws://far.example:8765
  vrs view --terminal day.vrst
"""


def view(options: Namespace) -> int:
    """Watch until the user leaves."""
    if not options.terminal:
        return show(options)
    if not on_terminal():
        raise CommandLineError("this is no terminal", "vrs where and vrs replay tell of a saved trajectory in a pipe")
    if not options.url:
        raise CommandLineError("--terminal shows a robot that is served, or a saved trajectory", "name one")
    if is_recording(options.url):
        from vrs_cli.repl.player import play

        recording = read_recording(options.prog, options.url, lenient=options.lenient)
        play(recording.arm, recording.timeline, options.rate, _world(options, recording.arm))
    else:
        asyncio.run(_watch(options))
    return 0


def view_parser(prog: str) -> Parser:
    from vrs_cli.net.far_end import Ahead
    from vrs_cli.net.mirror import WINDOW

    return Parser(
        prog,
        "Watch a robot, and drive it: in a browser, or on the terminal.",
        EPILOG,
        option(
            "url",
            metavar="FILE.v2|T.vrst|URL",
            nargs="?",
            help=f"{ADDRESS}; a program file, or a saved trajectory; nothing: a new robot, and the shell beside it",
        ),
        CONNECTION,
        option("--terminal", action="store_true", help="on the terminal: joints, tool, clock, who drives"),
        group(
            "the browser",
            option("--no-open", action="store_true", help="print the address alone"),
            option("--port", rare=True, type=port, default=0, help="default: any that is free"),
            option(
                "--host", rare=True, default="127.0.0.1", help="an address of this machine alone (default: 127.0.0.1)"
            ),
        ),
        *ROBOT,
        option("--cell", metavar="CELL.toml", help=CELL_HELP),
        option(
            "--rate", rare=True, metavar="R", type=clock_rate, default=1.0, help="seconds of it in one (default: 1)"
        ),
        option("--no-run", rare=True, action="store_true", help="load the file, and execute nothing"),
        option(
            "--window",
            rare=True,
            metavar="S",
            type=positive,
            default=WINDOW,
            help=f"so many seconds of the robot's past are kept (default {WINDOW:g})",
        ),
        option(
            "--ahead",
            rare=True,
            metavar="T|auto",
            type=_ahead,
            default=Ahead.PRESENT,
            help="a robot in real time as it will be, so long after what is heard of it; auto: where a command of now "
            "finds it, D_f + D_b as measured (default: its present)",
        ),
        LENIENT,
    )


def _world(options: Namespace, arm: RobotArm) -> World | None:
    """The world of --cell, for pictures on the terminal. Raises FileError."""
    if options.cell is None:
        return None
    from vrs_cli.world.world import World

    return World(arm, read_cell(options.cell))


async def _watch(options: Namespace) -> None:
    """A robot afar. Raises RequestRefused, and what the server refuses."""
    from vrs_cli.net.far_end import Predicted
    from vrs_cli.repl.player import watch

    client = client_of(options)
    news, predicted = News(), Predicted(client.far)
    client.far.ahead = options.ahead
    client.told = news.cut
    client.far.news.append(news.hear)
    try:
        await client.open()
        mirror = await client.follow(options.window if options.cell is None else inf)

        def lines(t: float) -> str:
            return "\n".join(line for line in (news.line(), *client.far.previewed().lines(t)) if line)

        world = client.far.world or _world(options, predicted.arm)
        await watch(predicted, lines, lambda: mirror.clock.rate is not None, lambda: _abort(client, news), world)
    finally:
        await client.close()


def _abort(client: Client, news: News) -> None:
    """Stop the robot; what became of that is told."""
    from vrs_cli.errors import VrsError
    from vrs_cli.net.messages import Abort

    try:
        client.begin(Abort, news.answered)
    except VrsError as error:
        news.cut(f"ABORT is not sent: {error}")


def _ahead(text: str) -> float | Ahead:
    """Seconds, or `auto`."""
    from vrs_cli.net.far_end import Ahead

    if text == Ahead.AUTO.value:
        return Ahead.AUTO
    try:
        return duration(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or {Ahead.AUTO.value}") from None


class News:
    """Collects news of a robot for one line: who drives, what runs, and whether it is heard of at all."""

    def __init__(self) -> None:
        self._activity = self._cut = self._said = ""

    def hear(self, message: ServerMessage) -> None:
        from vrs_cli.net.messages import Activity, Welcome

        match message:
            case Activity(driver, programs):
                runs = f"{', '.join(programs) or 'no program'} {'run' if len(programs) > 1 else 'runs'}"
                self._activity = f"{driver or 'nobody'} drives; {runs}"
                self._said = "" if programs else self._said
            case Welcome():
                self._cut = ""

    def cut(self, why: str) -> None:
        self._cut = why

    def answered(self, message: ServerMessage) -> None:
        """Keep the answer to ABORT."""
        from vrs_cli.net.messages import Done, Told
        from vrs_cli.render.text import plain_text

        match message:
            case Told(reply):
                self._said = plain_text(reply).strip()
            case Done(refusal=refusal) if refusal is not None:
                self._said = str(refusal.error())

    def line(self) -> str:
        return "; ".join(filter(None, (self._cut or self._activity, self._said)))


# --- in a browser ---------------------------------------------------------------------------------------------------


def show(options: Namespace) -> int:
    """Serve the page until a signal ends it, or the user of the shell beside it; returns the exit status. Raises
    VrsError.
    """
    from vrs_cli.cli.page import host_program, host_robot, page_place, relay_robot, serve_recording

    at_page, url = page_place(options), options.url or ""
    cell = None if is_program(url) or options.cell is None else read_cell(options.cell)
    with ExitStack() as stack:
        if is_program(url):
            host_program(options, stack, at_page, read_cell)
        elif is_recording(url):
            serve_recording(options, stack, at_page, cell)
        elif url:
            relay_robot(options, stack, at_page, cell)
        else:
            return run_beside(options, stack, host_robot(options, stack, at_page, chosen_robot(options), cell, None))
        asyncio.run(signal_comes())
    return 0


def run_beside(options: argparse.Namespace, stack: ExitStack, local_robot: LocalRobot) -> int:
    """Run the shell beside the page; on a pipe, the page stays when the lines are done."""
    from vrs_cli.net.socket_port import SocketPort
    from vrs_cli.repl.connection import Remote
    from vrs_cli.repl.shell import at

    connection = SocketPort(local_robot.client(attended=on_terminal()))
    stack.callback(connection.close)
    status = at(Remote(connection, teller(options.prog)))
    if not on_terminal():
        asyncio.run(signal_comes())
    return status


def read_cell(path: str) -> Cell:
    from vrs_cli.files.cell_file import read_cell

    return read_cell(path)
