"""Mirrors in another process, over sockets that are cut again and again: python -m tests.net.mirrors 100000 [CUTS]

A robot is edited at random: motions of all kinds, undo, redo, ABORT, steering, branches, MERGE, other timelines. Who
holds it afar has the same timeline to the bit: in JSON and in MessagePack, all of it and a window, with and without
cuts.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time
from hashlib import sha256
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, NamedTuple

from msgspec.structs import replace

from tests.by_hand import command
from tests.interfaces.holders.holder import Holder
from tests.live import PATIENCE, until
from tests.net.cable import cable
from tests.net.edits import Edits
from tests.net.serving import Serving, serving
from vrs_cli.interfaces.session.session import Session
from vrs_cli.net.client import Client, hello_of
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.codec import Encoding

TOGETHER = 20  # edits between two looks at what else there is to do
WINDOW = 5.0  # [s]


class Kind(NamedTuple):
    """One mirror: over the cable that is pulled or not, in which form, and from when on."""

    name: str
    cut: bool
    encoding: Encoding
    window: float = inf
    full: bool = False


KINDS = (
    Kind("steady", False, Encoding.MSGPACK),
    Kind("cut", True, Encoding.MSGPACK),
    Kind("cut, in full", True, Encoding.MSGPACK, full=True),
    Kind("cut, JSON", True, Encoding.JSON),
    Kind("cut, a window", True, Encoding.MSGPACK, WINDOW),
)


def digest(timeline: Timeline, last: int) -> str:
    """Of the last segments and the version, to the bit."""
    segments = [timeline[k] for k in range(len(timeline) - last, len(timeline))]
    return sha256(repr((timeline.version, segments)).encode()).hexdigest()


class Tally(NamedTuple):
    """What was done, and what the mirrors have become."""

    edits: dict[str, int]
    changes: int
    cuts: int
    wrong: list[str]
    seconds: float


def compare(edits: int, cuts: int, seed: int = 1) -> Tally:
    """Edit a robot so often, and cut the connections to it so often."""
    began = time.process_time()
    with (
        TemporaryDirectory() as folder,
        serving(Path(folder), journal=False) as served,
        cable(served.address) as to_it,
        subprocess.Popen(
            [sys.executable, "-m", "tests.net.mirrors", "--watch", served.address, to_it.url],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        ) as watching,
    ):
        said, told = _pipes(watching)
        assert said.readline() == "ready\n"
        room = served.hub.rooms["cell1"]
        holder, at_work = Holder(room.session), Edits(seed, room.session.engine, room.session.branches)
        for done in range(0, edits, TOGETHER):
            holder.call(lambda _session: [at_work.edit() for _ in range(TOGETHER)]).result(PATIENCE)
            if done * cuts // edits != (done + TOGETHER) * cuts // edits:
                to_it.pull()
        number, timeline = _end(served, holder)
        told.write(f"{number}\n")
        told.flush()
        found = json.loads(said.readline())
        wrong = [name for name, (last, theirs) in found.items() if theirs != digest(timeline, last)]
        return Tally(at_work.counts, number, to_it.pulled, wrong, time.process_time() - began)


def _pipes(watching: subprocess.Popen[str]) -> tuple[IO[str], IO[str]]:
    assert watching.stdout is not None
    assert watching.stdin is not None
    return watching.stdout, watching.stdin


def _end(served: Serving, holder: Holder) -> tuple[int, Timeline]:
    """The number of the last change, and the timeline then."""
    room = served.hub.rooms["cell1"]

    def engine_timeline(session: Session) -> Timeline:
        return session.engine.timeline

    timeline = holder.call(engine_timeline).result(PATIENCE)
    until(lambda: room.broadcast.stream.timeline == timeline, "all that has happened is told")
    return room.broadcast.stream.number, timeline


# --- the other process ----------------------------------------------------------------------------------------------


async def watch(straight: str, pulled: str) -> dict[str, Any]:
    """Follow the robot with every kind of mirror, up to the change that is named on stdin; what they have become."""
    clients = {}
    for kind in KINDS:
        hello = replace(hello_of(name=kind.name), format=kind.encoding, full=kind.full)
        clients[kind] = Client(pulled if kind.cut else straight, hello)
        await clients[kind].open()
        await clients[kind].follow(kind.window)
    print("ready", flush=True)
    number = int(await asyncio.to_thread(sys.stdin.readline))
    found = {}
    for kind, client in clients.items():
        mirror = client.far.mirror
        assert mirror is not None
        async with asyncio.timeout(PATIENCE):
            while mirror.seq < number or mirror.lost or (kind.window == inf and mirror.begins > 0.0):
                await asyncio.sleep(0.01)
        found[kind.name] = len(mirror.timeline), digest(mirror.timeline, len(mirror.timeline))
        await client.close()
    return found


def main(edits: int, cuts: int = 100) -> int:
    tally = compare(edits, cuts)
    done = ", ".join(f"{count} {name}" for name, count in sorted(tally.edits.items()))
    print(f"{edits} edits ({done}): {tally.changes} changes told, {tally.cuts} cuts of {len(KINDS) - 1} connections")
    print(f"{tally.seconds:.0f} s of CPU; not equal to the bit: {', '.join(tally.wrong) or 'none'}")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--watch"]:
        print(json.dumps(asyncio.run(watch(*sys.argv[2:]))), flush=True)
    else:
        command(main)
