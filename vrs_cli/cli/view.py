"""`vrs view`: watch and drive a robot in a browser, or watch one on the terminal; or a saved trajectory."""

from __future__ import annotations

import argparse
import asyncio
from argparse import Namespace
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import ROBOT, CommandLineError, Parser, clock_rate, group, option, positive
from vrs_cli.cli.connections import ADDRESS, CONNECTION, client_of, duration
from vrs_cli.cli.connections import EPILOG as TOKENS
from vrs_cli.cli.serve import port
from vrs_cli.cli.sources import LENIENT, is_recording, read_recording
from vrs_cli.repl.shell import on_terminal

if TYPE_CHECKING:
    from vrs_cli.net.client import Client
    from vrs_cli.net.far_end import Ahead
    from vrs_cli.net.messages import ServerMessage


EPILOG = f"""\
In the browser: a new robot, which the VAL-II shell in this terminal drives too;
one that executes a program; a trajectory; a robot that is served.

  vrs view
  vrs view pick.v2 --rate 0.5
  vrs view day.vrst
  vrs view ws://127.0.0.1:8765

The page is for this machine alone. Ctrl-C, or SIGTERM, ends it (in the shell: EXIT).

On the terminal: space plays and pauses, left and right seek, r rewinds, f follows
the robot again, + and - change the rate, Ctrl-X aborts what others have it do, q leaves.

  vrs view --terminal ws://127.0.0.1:8765
  vrs view --terminal --ahead auto ws://far.example:8765
  vrs view --terminal day.vrst

{TOKENS}"""


def view(options: Namespace) -> int:
    """Watch until the user leaves."""
    if not options.terminal:
        from vrs_cli.cli.browser import show

        return show(options)
    if not on_terminal():
        raise CommandLineError("this is no terminal", "vrs where and vrs replay tell of a saved trajectory in a pipe")
    if not options.url:
        raise CommandLineError("--terminal shows a robot that is served, or a saved trajectory", "name one")
    if is_recording(options.url):
        from vrs_cli.repl.player import play

        recording = read_recording(options.prog, options.url, lenient=options.lenient)
        play(recording.arm, recording.timeline, options.rate)
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
            option("--port", type=port, default=0, help="default: any that is free"),
            option("--host", default="127.0.0.1", help="an address of this machine alone (default: 127.0.0.1)"),
        ),
        *ROBOT,
        option("--rate", metavar="R", type=clock_rate, default=1.0, help="seconds of it in one (default: 1)"),
        option("--no-run", action="store_true", help="load the file, and execute nothing"),
        option(
            "--window",
            metavar="S",
            type=positive,
            default=WINDOW,
            help=f"so many seconds of the robot's past are kept (default {WINDOW:g})",
        ),
        option(
            "--ahead",
            metavar="T|auto",
            type=_ahead,
            default=Ahead.PRESENT,
            help="a robot in real time as it will be, so long after what is heard of it; auto: where a command of now "
            "finds it, D_f + D_b as measured (default: its present)",
        ),
        LENIENT,
    )


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
        mirror = await client.follow(options.window)

        def lines(t: float) -> str:
            return "\n".join(line for line in (news.line(), *client.far.previewed().lines(t)) if line)

        await watch(predicted, lines, lambda: mirror.clock.rate is not None, lambda: _abort(client, news))
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
    """What there is to tell of a robot beside where it is: who drives, what runs, and whether it is heard of at all."""

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
        """What is said of ABORT."""
        from vrs_cli.net.messages import Done, Told
        from vrs_cli.render.text import plain_text

        match message:
            case Told(reply):
                self._said = plain_text(reply).strip()
            case Done(refusal=refusal) if refusal is not None:
                self._said = str(refusal.error())

    def line(self) -> str:
        return "; ".join(filter(None, (self._cut or self._activity, self._said)))
