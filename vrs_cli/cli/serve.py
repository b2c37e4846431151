"""Carry out `vrs serve`: serve robots over the network."""

from __future__ import annotations

import asyncio
import ssl
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from importlib.util import find_spec
from math import inf
from pathlib import Path

from vrs_cli.cli import main
from vrs_cli.cli.command_line import USUAL_ROBOT, CommandLineError, refuse, tell_notes, teller
from vrs_cli.cli.outputs import make_folder
from vrs_cli.extras import how_to_install
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.dialogue import Notes
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import Ends, load_robot
from vrs_cli.language.text.collector import collect_in_small_parts
from vrs_cli.net import class_board, http, limits, room, served_robot
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.server import ListenAddress, Server
from vrs_cli.net.tokens import OWN_ROBOTS, ClassFolder, TokenFile
from vrs_cli.render.text import styled_lines
from vrs_cli.repl import interrupt

WARM = ("WHERE", "MOVE #PPOINT(10, -80, 80, 5, 5, 5)", "x = 1", "TYPE x", "LISTR", "STATUS")


def serve(options: Namespace) -> int:
    """Serve robots until a signal arrives; return the exit status."""
    folder_of_class = _take_class(options)
    _check(options)
    from tempfile import TemporaryDirectory

    sys.setswitchinterval(0.001)  # [s] with Python's default 5 ms, threads at start-up would delay typed lines
    tell = teller(options.prog)
    with ExitStack() as at_end:
        at_end.enter_context(collect_in_small_parts())
        path = options.audit or (options.journal and Path(options.journal) / "audit.jsonl")
        audit = Audit(Path(path) if path else None, time.time, tell)
        at_end.callback(audit.close)
        if options.folder is not None:
            made = make_folder(str(Path(options.folder)), f"--folder {Path(options.folder)}", "name a folder")
            folder = Path(made)
        else:
            folder = Path(at_end.enter_context(TemporaryDirectory(prefix="vrs-")))
        named, tokens = (name for name, _ in options.robot), None
        if options.tokens is not None:
            tokens = TokenFile(Path(options.tokens), named, options.robots_per_token)
        if options.insecure and not options.tls_cert and not http.is_local(options.host):
            tell("--insecure: whoever is on the way can read the tokens, and drive")
        place = ListenAddress(options.host, options.port, _tls(options), tuple(options.origin))
        pages = http.ServedPage.read(cookies=True) if options.pages else None
        server = Server(place, _allowance(options), audit, tokens, tell, pages)
        hub = _hub(options, server, audit, folder, tell)
        if folder_of_class is not None:
            from vrs_cli.teach.served_lessons import ServedLessons

            server.board = class_board.ClassBoard(folder_of_class, hub.clients, server.grants, hub.own_names, time.time)
            lessons = ServedLessons(folder_of_class.lessons, server.begin_anew, tell)
            server.board.lessons, hub.planned = lessons, lessons.plan
            server.opened.append(lessons.start_at)
        at_end.callback(hub.close)
        # Load modules now, so that the first user's first line need not wait for them
        session = Session(Notes())
        for line in WARM:
            session.perform(line)
        hub.open_all()
        sys.setswitchinterval(0.0005)  # [s] with Python's default 5 ms, many observers would delay each line
        return asyncio.run(_run_server(options, server, hub, tell))


def _take_class(options: Namespace) -> ClassFolder | None:
    """Set the options that --class implies: its tokens, its folders, and the page. Return the class folder; None if
    --class is not given. Raises CommandLineError."""
    if options.class_folder is None:
        return None

    found = ClassFolder(Path(options.class_folder))
    own = next((name for name in ("tokens", "journal", "folder") if getattr(options, name) is not None), "")
    refuse(
        (own, f"--class has its own --{own}", f"leave out --{own}"),
        (not found.tokens.exists(), f"{found.root} is no class", f"vrs class new {found.root} NAME ..."),
    )
    options.tokens, options.journal, options.folder = str(found.tokens), str(found.journal), str(found.files)
    options.robots_per_token, options.pages = options.robots_per_token or OWN_ROBOTS, True
    return found


async def _run_server(options: Namespace, server: Server, hub: room.Hub, tell: Callable[[str], None]) -> int:
    stop = asyncio.Event()
    ending = asyncio.create_task(interrupt.signal_comes())
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
    return main.OK


# --- mistakes in a command line ---


def _check(options: Namespace) -> None:
    """Raise CommandLineError for options that would admit other people without a token, or let them read the
    connection."""
    names, shown = [name for name, _ in options.robot], [name for name, _ in options.cell]
    twice, double = (next((one for one in rows if rows.count(one) > 1), None) for rows in (names, shown))
    served = names or ([] if options.robots_per_token else [USUAL_ROBOT])
    unknown = next((name for name in shown if name and name not in served), None)
    chosen = options.base or options.tip or options.task
    afar, make = not http.is_local(options.host), "vrs class token makes tokens"
    refuse(
        (twice, f"--robot {twice} is there twice", "give each a name of its own: NAME=ROBOT"),
        (
            double is not None,
            f"--cell is there twice for {f'robot {double}' if double else 'all robots'}",
            "give each robot one: --cell NAME=CELL.toml",
        ),
        (unknown, f"--cell {unknown}=: there is no such robot", f"named robots: {', '.join(served) or 'none'}"),
        (
            chosen and len(names) != 1,
            "--base, --tip and --task choose of one robot that is named",
            "give one --robot, or urdf_base, urdf_tip and task in a TOML file of each",
        ),
        (options.tls_key and not options.tls_cert, "--tls-key without --tls-cert", "give both"),
        (options.robots_per_token and not options.tokens, "--robots-per-token without --tokens", make),
        (afar and not options.tokens, f"--host {options.host} without --tokens: anybody could drive", make),
        (
            afar and not options.tls_cert and not options.insecure,
            f"--host {options.host} without TLS: tokens and all else could be read on the way",
            "--tls-cert and --tls-key, or --insecure if you know the network",
        ),
    )


# --- reading the options ---


def _tls(options: Namespace) -> ssl.SSLContext | None:
    if not options.tls_cert:
        return None

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(options.tls_cert, options.tls_key)
    except OSError as error:  # also SSLError, which is a subclass
        files = " and ".join(filter(None, (options.tls_cert, options.tls_key)))
        raise CommandLineError(f"{files}: {error.strerror or error}", "a certificate and its key, in PEM") from None
    return context


def _allowance(options: Namespace) -> limits.Allowance:
    given = {
        "connections": options.max_connections,
        "folder": options.max_folder,
        "segments": options.max_segments,
        "steps": options.max_steps,
    }
    return limits.Allowance(**{name: value for name, value in given.items() if value is not None})


def _hub(options: Namespace, server: Server, audit: Audit, folder: Path, tell: Callable[[str], None]) -> room.Hub:
    ends = Ends(options.base, options.tip)
    wanted = options.robot or ([] if options.robots_per_token else [(USUAL_ROBOT, USUAL_ROBOT)])
    robots: Mapping[str, RobotModel] = {name: load_robot(robot, ends, options.task) for name, robot in wanted}
    for model in robots.values():
        tell_notes(tell, model, fitted=options.task is None)
    journal = options.journal
    if journal is not None:
        journal = Path(make_folder(str(Path(journal)), f"--journal {Path(journal)}", "name a folder"))
    cells = {name: read_cell(file) for name, file in options.cell}
    usual = served_robot.Plan(
        load_robot(options.own_robot),
        Path(),
        realtime=options.realtime,
        causality=options.causality or "",
        when_gone=served_robot.WhenGone(options.when_driver_goes),
        allowance=_allowance(options),
        idle=inf if options.idle is None else options.idle,
        cell=cells.pop("", None),
        styled=styled_lines,
    )
    places, own = room.RobotFolders(journal, folder), options.robots_per_token
    # [s] without users, after which a robot that only one token may use is paused
    idle = 600.0 if options.idle is None else options.idle
    wake, grants = server.wake, server.grants
    return room.Hub(robots, places, usual, audit, wake, tell, own=own, grants=grants, own_idle=idle, cells=cells)
