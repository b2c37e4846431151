"""Conversations about a timeline: snapshots, windows, changes and gaps, of robots of several kinds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from random import Random
from typing import Any

from tests.laws.sessions import Session
from tests.net.kit.conversation import Conversation
from tests.net.kit.recorder import Recorder
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, rotation_z, translation
from vrs_cli.values.commands import HAND, JointTarget, Move, SetBase, SetChannels, SetParameter, SetTool, Stamp

EXACT, CLOSED, SEARCHED, PIECES = 1e-12, 1e-9, 1e-6, 1e-3  # [rad, m] how near g has to be
CHANNELS = (HAND, 1)
LOOKS = 12  # times of one look at g
SUBSCRIBE = {"type": "subscribe", "deltas": True}
BASE = compose(translation(0.1, -0.2, 0.05), rotation_z(0.5))
PUMA = load_robot("puma560")


class Edits:
    """Random edits of a robot from a seed: motions at all times, TOOL, BASE, the hand, signals, UNDO."""

    def __init__(self, seed: int, model: RobotModel) -> None:
        self.session = Session(seed, model)
        self.engine, self.random = Engine(model), Random(seed)
        self.session.engine = self.engine  # its own tells of changes to nobody else
        begin = Move(self.session.joints_target(), False)
        for request in (SetTool(translation(0.0, 0.0, 0.08)), SetBase(BASE), SetParameter("INSERT", "ON"), begin):
            self.engine.perform(request)

    def edit(self) -> None:
        """One edit that is not refused."""
        version = self.engine.timeline.version
        while self.engine.timeline.version == version:
            with suppress(VrsError):
                if (chance := self.random.random()) < 0.08:
                    self.engine.undo()
                elif chance < 0.25:
                    stamp = Stamp(self.session.instant())
                    value = float(self.random.random() < 0.5)
                    self.engine.perform(SetChannels(((1, value),), stamp=stamp))
                else:
                    self.engine.perform(self.session.request(), program=self.random.random() < 0.5)

    def times(self) -> list[float]:
        """Times anywhere, before the begin and after the end too, and on boundaries."""
        timeline, random = self.engine.timeline, self.random
        anywhere = [round(random.uniform(-0.2, timeline.end + 0.5), 4) for _ in range(LOOKS - 3)]
        return sorted([*anywhere, *(random.choice([one.start, one.finish]) for one in random.choices(timeline, k=3))])


def edited(
    name: str, about: str, model: RobotModel, seed: int, within: float, *needs: str, changes: int = 12, **wanted: Any
) -> Conversation:
    """A snapshot of what a robot did, then changes; g is looked at after each third of them."""
    edits = Edits(seed, model)
    recorder = Recorder(name, about, ("timeline", *needs), edits.engine)
    for _ in range(3):
        edits.edit()
    recorder.tell_changes()
    recorder.open(full=True)
    recorder.do(SUBSCRIBE | wanted, "changes")
    for k in range(changes + 1):
        if k:
            edits.edit()
            recorder.tell_changes()
        if k % 3 == 0:
            times = edits.times()
            recorder.joints(times, within)
            if "joints" not in wanted:
                recorder.tools(times[::4], within)
            for channel in CHANNELS:
                recorder.values(channel, times)
    return recorder.conversation()


def robots() -> Iterator[Conversation]:
    """Random edits of robots of all kinds, with lines by inverse kinematics and as pieces."""
    for name, seed, within, *needs in (
        ("puma560", 2, CLOSED),
        ("cobra600", 5, CLOSED),
        ("planar2", 3, CLOSED),
        ("planar3", 12, CLOSED),
        ("panda", 1, SEARCHED, "redundant"),
        ("so100", 1, SEARCHED, "steady"),
    ):
        model = load_robot(name)
        about = f"random edits of {model.name}: TOOL, BASE, motions at all times, events, UNDO"
        yield edited(name, f"{about}; lines by inverse kinematics", model, seed, within, "kinematics", *needs)
        yield edited(f"{name}-pieces", f"{about}; lines as pieces", model, seed, PIECES, joints=PIECES)


def steered() -> Iterator[Conversation]:
    """Targets of a stream, in short and in full."""
    for profile, full, *needs in (("LSPB", False, "lspb"), ("SCURVE", False, "scurve"), ("SCURVE", True)):
        engine = Engine(PUMA)
        engine.perform(SetParameter("PROFILE", profile))
        name = f"steered-{'full' if full else profile.lower()}"
        about = f"targets of a stream with profile {profile}, " + ("in full" if full else "as `steered`")
        recorder = Recorder(name, about, ("timeline", *needs), engine)
        recorder.open(**({"full": True} if full else {}))
        recorder.do(SUBSCRIBE, "changes")
        steering, random = Steering(engine), Random(5)
        goal = list(engine.position().joints)
        for k in range(12 if full else 30):
            goal = [q + random.uniform(-0.01, 0.02) * (1.0 if k < 20 else 0.0) for q in goal]
            steering.to(tuple(goal), 0.5 + 0.02 * k)
            recorder.tell_changes()
            if k % 10 == 9:
                recorder.joints([round(random.uniform(0.4, engine.end + 0.2), 4) for _ in range(LOOKS)], CLOSED)
        steering.finish()
        recorder.tell_changes()
        recorder.joints([round(random.uniform(0.4, engine.end + 0.2), 4) for _ in range(LOOKS)], CLOSED)
        yield recorder.conversation()


def moved(engine: Engine, count: int, seed: int = 3) -> None:
    """So many motions of the joints, one after the other."""
    random = Random(seed)
    for _ in range(count):
        _, *others = engine.position(engine.end).joints
        engine.perform(Move(JointTarget((random.uniform(-1.0, 1.0), *others)), straight=False))


def parts() -> Iterator[Conversation]:
    """Timelines of which a client knows a part, or misses one."""
    engine = Engine(PUMA)
    moved(engine, 8)
    recorder = Recorder("window", "the last seconds; a change that reaches before them", ("timeline",), engine)
    recorder.open(full=True)
    recorder.do(SUBSCRIBE | {"window": 1.5}, "changes")
    late = [engine.now - 1.4, engine.now - 0.7, engine.now, engine.now + 1.0]
    recorder.joints(late, EXACT)
    moved(engine, 2, 4)
    recorder.tell_changes()
    recorder.joints([*late, engine.now], EXACT)
    engine.perform(Move(JointTarget((0.5, *engine.position(0.4).joints[1:])), straight=False, stamp=Stamp(0.4)))
    recorder.tell_changes()
    recorder.joints([engine.end - 1.0, engine.end - 0.3, engine.end], EXACT)
    yield recorder.conversation()

    engine = Engine(PUMA)
    moved(engine, 8)
    recorder = Recorder("older", "the last second, then all before it by `window`", ("timeline", "older"), engine)
    recorder.open(full=True)
    recorder.do(SUBSCRIBE | {"window": 1.0}, "changes")
    known = engine.timeline[engine.timeline.index_at(engine.now - 1.0)].start
    recorder.do({"type": "window", "begin": 0.0, "end": known}, "older")
    recorder.joints([0.0, 0.3, 1.0, known, known + 0.3, engine.end], EXACT)
    yield recorder.conversation()

    engine = Engine(PUMA)
    recorder = Recorder("gap", "changes that never come, others that were already there", ("timeline",), engine)
    recorder.open(full=True)
    recorder.do(SUBSCRIBE, "changes")
    moved(engine, 3)
    recorder.tell_changes(lose=1)
    recorder.joints([0.0, 0.5, 1.0, engine.end], EXACT)
    yield recorder.conversation()

    engine = Engine(PUMA)
    branches = Branches(engine)
    recorder = Recorder("branches", "other timelines take the place of the one that was known", ("timeline",), engine)
    recorder.open(full=True)
    recorder.do(SUBSCRIBE, "changes")
    moved(engine, 2)
    for name, seed in (("trial", 6), ("main", 7)):
        (branches.change_over if name in branches else branches.make)(name)
        moved(engine, 1, seed)
        recorder.tell_changes()
        recorder.joints([0.2, 0.9, engine.end - 0.3, engine.end], EXACT)
    yield recorder.conversation()

    engine = Engine(PUMA)
    recorder = Recorder("msgpack", "the server sends MessagePack", ("timeline", "msgpack"), engine)
    recorder.open(full=True, format="msgpack")
    recorder.do(SUBSCRIBE, "changes")
    moved(engine, 2)
    recorder.tell_changes()
    recorder.joints([0.2, 0.9, engine.end], EXACT)
    yield recorder.conversation()
