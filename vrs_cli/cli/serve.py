"""`vrs serve`: robots that others hold over the network; `vrs class token`: who may enter such a server."""

from __future__ import annotations

import argparse
import sys
from argparse import Namespace
from collections.abc import Mapping
from contextlib import ExitStack
from datetime import date, datetime
from importlib.util import find_spec
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import (
    CHOICES,
    REALTIME,
    USUAL_ROBOT,
    CommandLineError,
    Parser,
    group,
    number,
    option,
    positive,
    size,
    tell_notes,
    teller,
    whole,
)
from vrs_cli.cli.main import OK
from vrs_cli.errors import FileError
from vrs_cli.extras import how_to_install

if TYPE_CHECKING:
    import ssl
    from collections.abc import Callable

    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.net.durable_log import Audit
    from vrs_cli.net.limits import Allowance
    from vrs_cli.net.room import Hub
    from vrs_cli.net.server import Server
    from vrs_cli.net.tokens import ClassFolder


# [s] after which a thread that computes lets another one go on; by default it is 5 ms, which a line of the prompt waits
# for several times in a row where several threads work beside the robot
SWITCHED = 0.001


TURN = 0.0005  # [s] after which one thread lets the next one go on: with Python's 5 ms many who look delay each line
OWN_IDLE = 600.0  # [s] that a robot of a token works for nobody
WARM = ("WHERE", "MOVE #PPOINT(10, -80, 80, 5, 5, 5)", "x = 1", "TYPE x", "LISTR", "STATUS")

EPILOG = """\
One robot, for this machine alone:

  vrs serve
  vrs connect ws://127.0.0.1:8765        (in another terminal)

Ctrl-C, or SIGTERM, ends it. See docs/serve.md and docs/security.md.

\f
Two robots in real time, which are there again after a crash:

  vrs serve --robot cell1=puma560 --robot cell2=cobra600 --realtime --journal journal

A class, each with a robot of her own (vrs class token makes the tokens):

  vrs serve --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem --tokens class.toml \\
            --robots-per-token 1 --journal journal --folder files
"""


def serve(options: Namespace) -> int:
    """Serve until a signal says to end."""
    folder_of_class = _take_class(options)
    _check(options)
    import asyncio
    import time
    from tempfile import TemporaryDirectory

    from vrs_cli.language.text.collector import collect_in_small_parts
    from vrs_cli.net.durable_log import Audit
    from vrs_cli.net.http import ServedPage, is_local
    from vrs_cli.net.server import ListenAddress, Server
    from vrs_cli.net.tokens import TokenFile

    sys.setswitchinterval(SWITCHED)
    tell = teller(options.prog)
    with ExitStack() as at_end:
        at_end.enter_context(collect_in_small_parts())
        path = options.audit or (options.journal and Path(options.journal) / "audit.jsonl")
        audit = Audit(Path(path) if path else None, time.time, tell)
        at_end.callback(audit.close)
        if options.folder is not None:
            folder = _made(Path(options.folder), "--folder")
        else:
            folder = Path(at_end.enter_context(TemporaryDirectory(prefix="vrs-")))
        named, tokens = (name for name, _ in options.robot), None
        if options.tokens is not None:
            tokens = TokenFile(Path(options.tokens), named, options.robots_per_token)
        if options.insecure and not options.tls_cert and not is_local(options.host):
            tell("--insecure: whoever is on the way can read the tokens, and drive")
        place = ListenAddress(options.host, options.port, _tls(options), tuple(options.origin))
        pages = ServedPage.read(cookies=True) if options.pages else None
        server = Server(place, _allowance(options), audit, tokens, tell, pages)
        hub = _hub(options, server, audit, folder, tell)
        if folder_of_class is not None:
            from vrs_cli.net.class_board import ClassBoard
            from vrs_cli.teach.served_lessons import ServedLessons

            server.board = ClassBoard(folder_of_class, hub.clients, server.grants, hub.own_names, time.time)
            lessons = ServedLessons(folder_of_class.lessons, server.begin_anew, tell)
            server.board.lessons, hub.planned = lessons, lessons.plan
            server.opened.append(lessons.start_at)
        at_end.callback(hub.close)
        _warm()
        hub.open_all()
        sys.setswitchinterval(TURN)
        return asyncio.run(_served(options, server, hub, tell))


def _take_class(options: Namespace) -> ClassFolder | None:
    """Take the options of a class: its tokens, its folders, and the page. Raises CommandLineError."""
    if options.class_folder is None:
        return None
    from vrs_cli.net.tokens import OWN_ROBOTS, ClassFolder

    found = ClassFolder(Path(options.class_folder))
    for name in ("tokens", "journal", "folder"):
        if getattr(options, name) is not None:
            raise CommandLineError(f"--class has its own --{name}", f"leave out --{name}")
    if not found.tokens.exists():
        raise CommandLineError(f"{found.root} is no class", f"vrs class new {found.root} NAME ...")
    options.tokens, options.journal, options.folder = str(found.tokens), str(found.journal), str(found.files)
    options.robots_per_token, options.pages = options.robots_per_token or OWN_ROBOTS, True
    return found


async def _served(options: Namespace, server: Server, hub: Hub, tell: Callable[[str], None]) -> int:
    import asyncio

    from vrs_cli.cli.remote import signal_comes

    stop = asyncio.Event()
    ending = asyncio.create_task(signal_comes())
    ending.add_done_callback(lambda _: stop.set())

    def ready(address: str) -> None:
        names, own = ", ".join(hub.rooms), options.robots_per_token
        said = [f"{'robot' if len(hub.rooms) == 1 else 'robots'} {names}"] if names else []
        said += [f"{own} of its own for each token"] if own else []
        print(f"{options.prog}: {address}, {', and '.join(said)}", flush=True)
        if options.pages:
            print(f"{options.prog}: {address.replace('ws', 'http', 1)} in a browser", flush=True)

    publisher = None
    if options.nats is not None:
        if find_spec("nats") is None:
            raise CommandLineError("--nats needs nats-py", how_to_install("nats-py"))
        from vrs_cli.net.nats import Publisher

        publisher = Publisher(options.nats, tell)
    try:
        if publisher is not None:
            await publisher.open()
            server.opened.append(publisher.add)
        await server.run(hub, ready, stop)
    except OSError as error:
        where = f"{options.host}:{options.port}"
        raise CommandLineError(f"{where}: {(error.strerror or str(error)).lower()}", "name another --port") from None
    finally:
        ending.cancel()
        if publisher is not None:
            await publisher.close()
    tell("ended")
    return OK


def serve_parser(prog: str) -> Parser:
    from vrs_cli.net.messages import PORT

    return Parser(
        prog,
        "Serve virtual robots to others: vrs connect, vrs view, vrs.connect(URL).",
        EPILOG,
        option("--host", default="127.0.0.1", help="the address to listen at (default: this machine alone)"),
        option("--port", type=port, default=PORT, help=f"default: {PORT}; 0: any that is free"),
        option(
            "--robot",
            metavar="NAME=ROBOT",
            type=_robot,
            action="append",
            default=[],
            help="a robot for all, and its name or file; may be repeated",
        ),
        *CHOICES,
        option(
            "--cell",
            metavar="[NAME=]CELL.toml",
            type=_cell,
            action="append",
            default=[],
            help="what is around each robot, or the named one; may be repeated",
        ),
        group(
            "a class",
            option("--class", dest="class_folder", metavar="FOLDER", help="of vrs class new: all that a class needs"),
            option("--tokens", metavar="FILE", help="who may enter, as what (TOML, read again when it changes)"),
            option(
                "--robots-per-token",
                rare=True,
                metavar="N",
                type=size,
                default=0,
                help="robots that each token has alone",
            ),
            option(
                "--own-robot",
                rare=True,
                metavar="ROBOT",
                default=USUAL_ROBOT,
                help=f"what these are (default: {USUAL_ROBOT})",
            ),
        ),
        group(
            "time",
            REALTIME,
            option(
                "--causality",
                rare=True,
                choices=("ABORT", "POSTPONE"),
                help="what becomes of commands that come too late",
            ),
            option(
                "--when-driver-goes",
                rare=True,
                choices=("go-on", "pause", "abort"),
                default="go-on",
                help="what a program does then (default: go-on)",
            ),
            option(
                "--idle",
                rare=True,
                metavar="SECONDS",
                type=_idle,
                help="pause a robot that works while nobody has held or watched it for so long; 0: never"
                f" (default: {OWN_IDLE:g} for those of --robots-per-token, never for others)",
            ),
        ),
        group(
            "what is kept",
            option("--journal", metavar="DIR", help="what robots do and know, kept over a restart"),
            option("--folder", metavar="DIR", help="the files of robots, one folder for each (default: temporary)"),
            option(
                "--audit", rare=True, metavar="FILE", help="a line for each command (default: audit.jsonl in --journal)"
            ),
        ),
        group(
            "the network",
            option("--tls-cert", metavar="FILE", help="the certificate of this server, with its chain (PEM)"),
            option("--tls-key", rare=True, metavar="FILE", help="its key (default: in the same file)"),
            option(
                "--insecure",
                rare=True,
                action="store_true",
                help="other machines too, though all can be read on the way",
            ),
            option("--pages", action="store_true", help="show the robots in browsers"),
            option(
                "--origin",
                rare=True,
                metavar="URL",
                action="append",
                default=[],
                help="pages of this site may connect too",
            ),
            option("--nats", rare=True, metavar="URL", help="publish all robots there, to look at: nats://HOST:4222"),
        ),
        group(
            "limits",
            option("--max-connections", rare=True, metavar="N", type=size, help="in all (default: 4000)"),
            option("--max-folder", rare=True, metavar="BYTES", type=size, help="in a robot's folder (default: 100M)"),
            option("--max-segments", rare=True, metavar="N", type=size, help="of a robot's timeline (default: 2M)"),
            option(
                "--max-steps", rare=True, metavar="N", type=size, help="of one run of a program (default: any number)"
            ),
            about="K, M and G are 1000, 1000K and 1000M.",
        ),
    )


def _idle(text: str) -> float:
    """Read how long a robot may work for nobody [s]; 0 is for ever."""
    return positive(text) if number(text) else inf


def port(text: str) -> int:
    number = whole(text)
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"{text} is no port (0 to 65535)")
    return number


def _robot(text: str) -> tuple[str, str]:
    """`cell1=puma560`; a robot alone has its own name."""
    name, equals, robot = text.partition("=")
    if not equals:
        name, robot = Path(text).stem, text
    from vrs_cli.net.tokens import NAME_RULE, good_name

    if not good_name(name):
        raise argparse.ArgumentTypeError(f"{name!r} is no name for a robot ({NAME_RULE}): NAME=ROBOT")
    return name, robot


def _cell(text: str) -> tuple[str, str]:
    """`cell1=pick.toml`; without a name, which is empty then, it is for all robots."""
    from vrs_cli.net.tokens import good_name

    name, equals, file = text.partition("=")
    return (name, file) if equals and good_name(name) and file else ("", text)


# --- what is wrong with a command line ---


def _check(options: Namespace) -> None:
    """Raises CommandLineError for what would let others in unasked, or be heard by others."""
    from vrs_cli.net.http import is_local

    names = [name for name, _ in options.robot]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise CommandLineError(f"--robot {twice} is there twice", "give each a name of its own: NAME=ROBOT")
    shown = [name for name, _ in options.cell]
    if (double := next((name for name in shown if shown.count(name) > 1), None)) is not None:
        whose = f"robot {double}" if double else "all robots"
        raise CommandLineError(f"--cell is there twice for {whose}", "give each robot one: --cell NAME=CELL.toml")
    served = names or ([] if options.robots_per_token else [USUAL_ROBOT])
    if unknown := next((name for name in shown if name and name not in served), None):
        there = ", ".join(served) or "none"
        raise CommandLineError(f"--cell {unknown}=: there is no such robot", f"named robots: {there}")
    if len(options.robot) != 1 and (options.base or options.tip or options.task):
        what = "--base, --tip and --task choose of one robot that is named"
        raise CommandLineError(what, "give one --robot, or urdf_base, urdf_tip and task in a TOML file of each")
    if options.tls_key and not options.tls_cert:
        raise CommandLineError("--tls-key without --tls-cert", "give both")
    if options.robots_per_token and not options.tokens:
        raise CommandLineError("--robots-per-token without --tokens", "vrs class token makes tokens")
    if is_local(options.host):
        return
    if not options.tokens:
        raise CommandLineError(
            f"--host {options.host} without --tokens: anybody could drive", "vrs class token makes tokens"
        )
    if not options.tls_cert and not options.insecure:
        what = f"--host {options.host} without TLS: tokens and all else could be read on the way"
        raise CommandLineError(what, "--tls-cert and --tls-key, or --insecure if you know the network")


# --- what is made of it ---


def _tls(options: Namespace) -> ssl.SSLContext | None:
    if not options.tls_cert:
        return None
    import ssl

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(options.tls_cert, options.tls_key)
    except OSError as error:  # SSLError too
        files = " and ".join(filter(None, (options.tls_cert, options.tls_key)))
        raise CommandLineError(f"{files}: {error.strerror or error}", "a certificate and its key, in PEM") from None
    return context


def _allowance(options: Namespace) -> Allowance:
    from vrs_cli.net.limits import Allowance

    given = {
        "connections": options.max_connections,
        "folder": options.max_folder,
        "segments": options.max_segments,
        "steps": options.max_steps,
    }
    return Allowance(**{name: value for name, value in given.items() if value is not None})


def _hub(options: Namespace, server: Server, audit: Audit, folder: Path, tell: Callable[[str], None]) -> Hub:
    from vrs_cli.files.cell_file import read_cell
    from vrs_cli.kinematics.robot_file import Ends, load_robot
    from vrs_cli.net.room import Hub, RobotFolders
    from vrs_cli.net.served_robot import Plan, WhenGone
    from vrs_cli.render.text import styled_lines

    ends = Ends(options.base, options.tip)
    wanted = options.robot or ([] if options.robots_per_token else [(USUAL_ROBOT, USUAL_ROBOT)])
    robots: Mapping[str, RobotModel] = {name: load_robot(robot, ends, options.task) for name, robot in wanted}
    for model in robots.values():
        tell_notes(tell, model, fitted=options.task is None)
    journal = None if options.journal is None else _made(Path(options.journal), "--journal")
    cells = {name: read_cell(file) for name, file in options.cell}
    usual = Plan(
        load_robot(options.own_robot),
        Path(),
        realtime=options.realtime,
        causality=options.causality or "",
        when_gone=WhenGone(options.when_driver_goes),
        allowance=_allowance(options),
        idle=inf if options.idle is None else options.idle,
        cell=cells.pop("", None),
        styled=styled_lines,
    )
    places, own = RobotFolders(journal, folder), options.robots_per_token
    idle = OWN_IDLE if options.idle is None else options.idle
    wake, grants = server.wake, server.grants
    return Hub(robots, places, usual, audit, wake, tell, own=own, grants=grants, own_idle=idle, cells=cells)


def _made(folder: Path, option: str) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{option} {folder}: {error.strerror}", "name a folder") from None
    return folder.resolve()


def _warm() -> None:
    """The first line of whoever comes first is not to wait for what is loaded late."""
    from vrs_cli.interfaces.dialogue import Notes
    from vrs_cli.interfaces.session.session import Session

    session = Session(Notes())
    for line in WARM:
        session.perform(line)


# --- vrs class token ------------------------------------------------------------------------------------------------


TOKEN_EPILOG = """\
The file holds hashes of tokens: what is printed here is told once.

  vrs class token tom --file class.toml --role teacher
\f

A server reads the file again when it changes.

  vrs class token ada bob carl --file class.toml
  vrs class token eve --file class.toml --role observer --robots cell1 --expires 2027-07-31
  vrs class token ada --file class.toml --revoke
"""


def token(options: Namespace) -> None:
    """Print a line for each name: the name and its token."""
    from vrs_cli.net.tokens import NAME_RULE, add_tokens, good_name, take_out

    wrong = next((name for name in options.names if not good_name(name)), None)
    if wrong is not None:
        raise CommandLineError(f"{wrong!r} is no name", NAME_RULE)
    path = Path(options.file)
    if options.revoke:
        take_out(path, options.names)
        return
    robots = None if options.robots is None else tuple(filter(None, options.robots.split(",")))
    for name, token in add_tokens(path, options.names, options.role, robots, options.expires).items():
        print(f"{name} {token}")


def token_parser(prog: str) -> Parser:
    roles = ("observer", "designer", "supervisor", "teacher", "body")
    return Parser(
        prog,
        "Make tokens, each for one who may enter a server (vrs serve --tokens FILE).",
        TOKEN_EPILOG,
        option("names", metavar="NAME", nargs="+", help="what others see; own robots are called so too"),
        option("--file", metavar="FILE", required=True, help="the file of tokens, made if need be"),
        option("--role", choices=roles, default="supervisor", help="what they may do (default: supervisor)"),
        option("--robots", metavar="A,B", help="the shared robots that they may hold (default: all)"),
        option("--expires", rare=True, metavar="DAY", type=_day, help="until the end of that day, or an instant"),
        option("--revoke", action="store_true", help="take the tokens of these names out of the file"),
    )


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no day (2027-07-31, or 2027-07-31T12:00:00)") from None
