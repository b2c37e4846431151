"""The table of what is wanted and what is reached, as Markdown: `python -m benchmarks results > benchmarks/RESULTS.md`.

A copy of an earlier table gives the column "before": `python -m benchmarks results EARLIER.md`.

Times are those of the process, the least of some rounds; a peer is measured beside us, in the same run. On a machine
that others use the table says so, and what it says is then worth little. It takes about five minutes, and more where
peers are yet to be installed.
"""

from __future__ import annotations

import gc
import os
import platform
import random
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from importlib.util import find_spec
from io import BytesIO
from math import degrees
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any, NamedTuple

from benchmarks import (
    body,
    bulk,
    divergence,
    engine,
    events,
    jitter,
    language,
    measured,
    program,
    prompt,
    robots,
    startup,
    steering,
    timeline,
    viewers,
    world,
)
from benchmarks import contacts as first_contacts
from benchmarks.peers import Peers, beside
from benchmarks.peers.timing import each
from vrs_cli.__main__ import COLLECT_AFTER
from vrs_cli.engine.book import Book
from vrs_cli.engine.comparison import compare
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import joints_at
from vrs_cli.files.exports import EXPORTERS
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.structure import canonical_text

WHY = "../docs/design.md#what-is-slower-than-wanted-and-why"
BUSY = 0.5  # processes that wait for a core, beside us, on the average of a minute
ROUNDS = 7  # of which the least counts: other users of a machine slow it down for seconds
TURNS = 3  # of two things that are compared
HOUR = 3600.0  # [s]
RATE = 1000.0  # [Hz] of an export
TIMES = 20_000  # read one by one
GROWTH = (1_000, 10_000, 100_000)


class Figure(NamedTuple):
    """What was measured, what is wanted of it (0: nothing), and what others need for the same."""

    what: str
    unit: str
    now: float
    wanted: float = 0.0
    peers: str = ""
    more_is_better: bool = False

    def row(self, before: str = "") -> str:
        met = self.now >= self.wanted if self.more_is_better else self.now <= self.wanted
        judged = ("yes" if met else f"no, {_ratio(self.now, self.wanted):.1f} times") if self.wanted else ""
        cells = self.what, before, f"{self.now:.4g} {self.unit}", _or_not(self.wanted, self.unit), judged, self.peers
        return f"| {' | '.join(cells)} |"


def _or_not(value: float, unit: str) -> str:
    return f"{value:g} {unit}" if value else ""


def _ratio(a: float, b: float) -> float:
    return max(a / b, b / a)


def least(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Seconds of the processor."""
    gc.collect()
    gc.freeze()
    try:
        return min(timeline.cpu(work) for _ in range(rounds))
    finally:
        gc.unfreeze()


# --- what is wanted ----------------------------------------------------------------------------------------------


def starting(_: Peers) -> Iterator[Figure]:
    """Each subcommand beside `python -c pass`, in turn."""
    seconds = startup.commands()
    bare = seconds.pop("python -c pass")
    wanted = {"vrs run hello.v2": 8.0, "vrs check hello.v2": 7.5}
    yield Figure("python -c pass", "ms", 1e3 * bare)
    for name, took in seconds.items():
        yield Figure(name, "x pass", took / bare, wanted.get(name, 0.0), f"{1e3 * took:.0f} ms")
    keys = startup.key_seconds()
    yield Figure(
        "a key at the prompt", "ms", 1e3 * keys["vrs"], 2.7, f"bare prompt-toolkit {1e3 * keys['bare']:.3g} ms"
    )


def motion(peers: Peers) -> Iterator[Figure]:
    """Ten minutes of pick and place, also by compiled modules, and its exports."""
    for what, text, wanted in (("every place new", program.NEW, 700.0), ("cyclic", program.PROGRAM, 2600.0)):
        took, robot, _count = min(program.run_once(text) for _ in range(ROUNDS))
        yield Figure(f"ten minutes of pick and place, {what}", "s per s", robot / took, wanted, "", True)
        compiled = peers.figures("compiled_vrs", {"program": text, "rounds": ROUNDS}).values
        for rate in compiled.values():
            yield Figure(f"- {what}, with compiled modules", "s per s", rate, wanted, "", True)
    session = Session(program.Silent())
    session.load_text(program.NEW.replace("TIME() < 600", "TIME() < 100"))
    session.execute("work")
    arm, course = session.engine.arm, session.engine.timeline
    for name, wanted in (("csv", 13.2), ("npz", 5.0), ("mcap", 15.0)):
        write = partial(EXPORTERS[name].write, arm=arm, timeline=course, rate=RATE)
        took = least(lambda write=write: write(BytesIO()))  # type: ignore[misc]
        yield Figure(f"{name} of an hour at 1 kHz", "s", took * HOUR / course.end, wanted)
    tracemalloc.start()
    with open(os.devnull, "wb") as nowhere:
        EXPORTERS["npz"].write(nowhere, arm, course, RATE)
    yield Figure("npz, memory at most", "MB", tracemalloc.get_traced_memory()[1] / 1e6, 300.0)
    tracemalloc.stop()


STATEMENT_BARS = {
    "x = i": 3.0,
    "IF i > 5 THEN": 3.0,
    "x = SIN(i)": 3.0,
    "a[7] = a[7]+1": 3.0,
    "$s = $ENCODE(/F8.2, i)": 6.0,
}
CALL_BARS = {"CALL sub": 1200.0, "CALL sub(i, 1, 2, 3, x, y)": 3500.0}


def statements(_: Peers) -> Iterator[Figure]:
    """Single statements of a program, beside the same lines of Python; calls in nanoseconds."""
    for name, ours, theirs in language.statement_times(100_000):
        if name in CALL_BARS:
            yield Figure(name, "ns", ours, CALL_BARS[name], f"Python {theirs:.3g} ns")
        else:
            yield Figure(name, "x Python", ours / max(theirs, 1.0), STATEMENT_BARS.get(name, 0.0), f"{ours:.3g} ns")


def stored(_: Peers) -> Iterator[Figure]:
    """Motions in memory, and a trajectory file of them."""
    engine.wandering(100)  # what the first motions compute once
    used, one = engine.traced(lambda: engine.wandering(10_000))
    segments = len(one.timeline)
    yield Figure("a segment of MOVE, memory of a session", "B", used / segments, 400.0)
    program.moved(100)
    used, session = engine.traced(lambda: program.moved(5_000))
    yield Figure("- of a program that rounds its corners", "B", used / len(session.engine.timeline))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "motions.vrst"
        write_trajectory(path, one.model, one.book.initial, one.book.deltas)
        # not `least`, which freezes the collector: what was read would then be collected, unlike in a process of a user
        took = min(timeline.cpu(lambda: read_trajectory(path)) for _ in range(ROUNDS))
    yield Figure("a trajectory file read, a segment", "us", 1e6 * took / segments, 5.0)


def kinematics(peers: Peers) -> Iterator[Figure]:
    for name, wanted in (("ur5e", 10.0), ("irb120", 10.0), ("puma560", 0.0)):
        model = load_robot(name)
        work = robots.links_of(model, robots.work_of(model))
        took, theirs = in_turn(partial(_inverse, model), lambda: beside("inverse", peers.figures("eaik_peer", work)))  # noqa: B023
        yield Figure(f"{name}, 8 branches", "us", took, wanted, theirs)
    for name, wanted in (("ur5e", 6.0), ("cobra600", 3.0), ("planar2", 1.5), ("puma560", 0.0)):
        arm, q = arm_for(load_robot(name)), robots.places(load_robot(name))
        took = each(arm.joint_velocity, q, [arm.twist(row, row) for row in q], rounds=5)
        yield Figure(f"{name}, joint velocity", "us", took, wanted)
    seven = load_robot(robots.SEVEN)
    work = robots.work_of(seven)
    took, theirs = in_turn(
        partial(robots.search_time, seven), lambda: beside("inverse", peers.figures("toolbox_peer", work))
    )
    yield Figure("7R, a solution", "us", took, 250.0, theirs)
    panda, puma = (load_robot(name) for name in ("panda", "puma560"))
    yield Figure("panda, a solution for a value of joint 7", "us", robots.branch_time(panda), 5.0)
    turns = [[robots.line(arm_for(one), robots.places(one)) for one in (panda, puma)] for _ in range(TURNS)]
    took, closed = map(min, zip(*turns, strict=True))
    yield Figure("MOVES of 200 mm, panda", "x puma560", took / closed, 1.5, f"{took:.0f} us")


def in_turn(ours: Callable[[], float], theirs: Callable[[], dict[str, float]]) -> tuple[float, str]:
    """What we need and what peers need, measured in turn: the least of each."""
    turns = [(ours(), theirs()) for _ in range(TURNS)]
    least_of = {name: min(found.get(name, us) for _, found in turns) for name, us in turns[0][1].items()}
    return min(own for own, _ in turns), ", ".join(f"{name} {us:.3g} us" for name, us in least_of.items())


def _inverse(model: Any) -> float:
    arm, q = arm_for(model), robots.places(model)
    return each(arm.branches, [arm.forward(row) for row in q])


def reading(_: Peers) -> Iterator[Figure]:
    """g for one time after another, drawn at random, beside bisect and Horner's rule written by hand."""
    for count, wanted in ((10_000, 0.0), (100_000, 1.5)):
        arm, course = timeline.tiled(count)
        times = _times(course.end)
        by_hand = engine.bisect_and_horner(course)
        took, theirs = in_turn(
            lambda: each(lambda t: joints_at(arm, course, t), times),  # noqa: B023
            lambda: {engine.BY_HAND: each(by_hand, times)},  # noqa: B023
        )
        yield Figure(f"g, one time of {count:,} segments, at random", "us", took, wanted, theirs)


def _times(end: float) -> list[float]:
    source = random.Random(2)
    return [source.uniform(0.0, end) for _ in range(TIMES)]


def planning(peers: Peers) -> Iterator[Figure]:
    tasks = engine.tasks()
    took, theirs = in_turn(
        lambda: engine.planned(tasks["from_motion"], Profile.SCURVE),
        lambda: beside("f from_motion", peers.figures("ruckig_peer", tasks)),
    )
    yield Figure("f, SCURVE out of motion", "us", took, 150.0, theirs)
    yield Figure("f, MOVES of 200 mm, LSPB", "us", engine.straight(Profile.LSPB).ours)
    yield Figure("f, MOVES of 200 mm, SCURVE", "us", engine.straight(Profile.SCURVE).ours, 700.0)


def steered(_: Peers) -> Iterator[Figure]:
    one = Engine(load_robot("puma560"))
    before = steering.memory()
    began = process_time()
    steering.stream(one, steering.TARGETS)
    took = process_time() - began
    yield Figure("an hour of steering at 50 Hz, memory", "MB", (steering.memory() - before) / 1e6, 60.0)
    yield Figure("- a target", "us", 1e6 * took / steering.TARGETS)


def parts(_: Peers) -> Iterator[Figure]:
    """1,000 parts, 100 of them taken elsewhere, ten light barriers."""
    found = world.costs()
    yield Figure("1,000 parts, 100 taken: the first course", "s", found.first)
    yield Figure("1,000 parts, after a command that shifts all", "ms", 1e3 * found.shifted, 200.0)
    yield Figure("1,000 parts, after a command at the end", "ms", 1e3 * found.at_end, 5.0)


def dated(_: Peers) -> Iterator[Figure]:
    yield from (Figure(*row) for row in events.figures())


def contacts(_: Peers) -> Iterator[Figure]:
    if find_spec("mujoco") is None:
        return
    made, motion = first_contacts.costs()
    yield Figure("contacts, the model of a scene", "ms", 1e3 * made, 30.0)
    yield Figure("first contact of a motion", "ms", 1e3 * motion, 3.5)


def measured_robot(_: Peers) -> Iterator[Figure]:
    """A body, what it reports, the watch over it, and steering over a jittery line."""
    if find_spec("mujoco") is not None:
        it = min((body.followed() for _ in range(ROUNDS)), key=lambda one: one.seconds)
        off = f"off by {degrees(body.errors(it).max()):.2g} deg at most"
        yield Figure("simulated PUMA 560 at 1 kHz", "s per s", body.SECONDS / it.seconds, 30.0, off, True)
        yield Figure("divergence, a report", "us", divergence.report_time(it))
    costs = measured.costs()
    yield Figure("a report of 6 joints with velocities, memory", "bytes a joint", costs.bytes / measured.JOINTS, 16.0)
    yield Figure("- taken", "us", costs.add)
    yield Figure("- g of the measured timeline, at random", "us", costs.look)
    yield Figure("- g, 200,000 times at once", "us", costs.together)
    rms = {name: jerk.rms for name, (jerk, _) in jitter.measured(600.0).items()}
    beside_it = f"naive {rms['naive']:.3g}, the targets {rms['targets']:.3g}"
    yield Figure("steering over gamma 200 +- 80 ms, jerk", "deg/s3 rms", rms["stamped"], 0.0, beside_it)


def watched(_: Peers) -> Iterator[Figure]:
    """A thousand viewers that keep up, in processes of their own."""
    if sys.platform != "linux":
        return
    found, who = viewers.samples(viewers.VIEWERS), f"{viewers.VIEWERS:,} viewers at {viewers.RATE:.0f} Hz"
    bare = f"websockets {1e6 * found.bare:.3g} us"
    yield Figure(f"{who}, CPU of the server for a sample", "us", 1e6 * found.sample, 1.3 * 1e6 * found.bare, bare)
    yield Figure("- samples that came, for those due", "%", 100.0 * found.came, 95.0, "", True)


def long_ones(_: Peers) -> Iterator[Figure]:
    for count, wanted in ((100_000, 0.0), (1_000_000, 2.0)):
        arm, course = timeline.tiled(count)
        other = course.apply(dict(timeline.deltas(course, random.Random(count)))["insert"])
        took = least(lambda: compare(arm, Book(course, course), Book(course, other)), 2)  # noqa: B023
        yield Figure(f"COMPARE, {count:,} segments", "s", took, wanted)
    fresh = iter(range(100))
    for count, wanted in ((10_000, 0.0), (100_000, 0.0)):
        took = least(lambda: canonical_text(bulk.program(count, next(fresh))), 2)  # noqa: B023
        yield Figure(f"fmt, {count:,} lines", "us a line", 1e6 * took / count, wanted)


# --- how it grows ------------------------------------------------------------------------------------------------


def names(count: int) -> float:
    session = prompt.session_with(count)
    return min(prompt.seconds(session, "n = n+1") for _ in range(20))


def lines(count: int) -> float:
    model, text = load_robot("puma560"), bulk.program(count, count)
    inspect(bulk.program(10, 0), model)  # the parser's tables are read
    return timeline.cpu(lambda: inspect(text, model)) / count


def segments(count: int) -> float:
    arm, course = timeline.tiled(count)
    times = _times(course.end)
    return 1e-6 * each(lambda t: joints_at(arm, course, t), times)


def edits(count: int) -> float:
    _, course = timeline.tiled(count)
    source = random.Random(count)
    changes = [dict(timeline.deltas(course, source))["insert"] for _ in range(400)]
    return 1e-6 * each(course.apply, changes)


def commands(count: int) -> float:
    one, source = engine.wandering(count), random.Random(3)
    return min(timeline.cpu(lambda: engine.wander(one, source)) for _ in range(20))


KINDS: dict[str, tuple[Callable[[int], float], tuple[int, ...]]] = {
    "a line of the prompt, names defined": (names, GROWTH),
    "check, a line, all different": (lines, GROWTH),
    "g at random, segments": (segments, (*GROWTH, 1_000_000)),
    "an insertion applied, segments": (edits, (*GROWTH, 1_000_000)),
    "MOVE appended, commands given": (commands, (1_000, 10_000)),
}


# --- the page ----------------------------------------------------------------------------------------------------

PARTS = (
    *(starting, statements, motion, kinematics, reading, stored, planning),
    *(steered, dated, contacts, parts, measured_robot, watched, long_ones),
)


def machine() -> str:
    try:
        told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        cpu = next(line.split(":", 1)[1].strip() for line in told.splitlines() if line.startswith("model name"))
    except (OSError, StopIteration):
        cpu = platform.processor()
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "lark", "msgspec"))
    return f"{cpu}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, {packages}"


def load_warning() -> str:
    waiting = os.getloadavg()[0]
    return f"**The machine was in use: {waiting:.1f} processes waited for a core.**\n\n" if waiting > 1.0 + BUSY else ""


def earlier(path: Path | None) -> dict[str, str]:
    """Return the figures of an earlier table by their names: the column "now"."""
    rows = path.read_text(encoding="utf-8").split("## ")[0].splitlines() if path else []
    tables = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows if row.startswith("|")]
    return {row[0]: row[tables[0].index("now")] for row in tables[2:]}


def main() -> None:
    before = earlier(Path(sys.argv[2]) if sys.argv[2:] else None)
    gc.set_threshold(COLLECT_AFTER)  # as a `vrs` command
    peers, warning = Peers(), load_warning()
    print(f"# Results\n\n{machine()}; {datetime.now(UTC):%Y-%m-%d}. Made by `python -m benchmarks results`.\n")
    print(f"What is slower than wanted, and why: [the design of vrs]({WHY}).\n")
    if sys.argv[2:]:
        machine_before = Path(sys.argv[2]).read_text(encoding="utf-8").splitlines()[2].split(". Made")[0]
        print(f"Before: {machine_before}.\n")
    print(f"{warning}| what | before | now | wanted | met | beside |\n|---|---|---|---|---|---|", flush=True)
    for part in PARTS:
        for figure in part(peers):
            print(figure.row(before.get(figure.what, "")), flush=True)
    print("\n## How it grows\n\nMicroseconds of one.\n")
    print("| what | 1,000 | 10,000 | 100,000 | 1,000,000 |\n|---|---|---|---|---|")
    for what, (measure, sizes) in KINDS.items():
        cells = [f"{1e6 * measure(size):.3g}" for size in sizes]
        print(f"| {what} | {' | '.join(cells + [''] * (4 - len(cells)))} |", flush=True)
    print("".join(f"\n{one}" for one in dict.fromkeys(peers.missing)))
    if warning:
        print(warning, file=sys.stderr)


if __name__ == "__main__":
    main()
