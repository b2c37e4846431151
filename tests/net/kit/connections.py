"""Conversations about the connection: commands and how they end, cuts, questions, what a later server may say."""

from __future__ import annotations

from collections.abc import Iterator

from tests.net.kit.conversation import Conversation
from tests.net.kit.recorder import Recorder
from tests.net.kit.timelines import EXACT, PUMA, SUBSCRIBE, moved
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import RequestRefused
from vrs_cli.net.messages import Alarm, BodyOrder, BodyReleased, BodyStatus, Clock, Embodied
from vrs_cli.values.measured import BodyMode, BodySeen, DivergenceAlarm, DivergenceCause
from vrs_cli.values.questions import Confirmation
from vrs_cli.values.results import Message
from vrs_cli.wire.messages import Asked, Done, Numbered, Refusal, Refused, Told, Withdrawn

REFUSED = Refusal.of(RequestRefused("there is no room", "wait"))


class Applause(Numbered, frozen=True):
    """A message of a later server, which has to be heard once."""

    claps: int


def recorder_of(name: str, about: str, *needs: str) -> Recorder:
    return Recorder(name, about, needs, Engine(PUMA))


def line(recorder: Recorder, name: str, *, arrives: bool = True) -> int:
    """The user types a line. Return its id."""
    recorder.do({"type": "line", "text": f"TYPE {name}"}, name, arrives=arrives)
    return recorder.id_of(name)


def commands() -> Conversation:
    it = recorder_of("commands", "commands that are done, refused by the robot, and not taken by the server")
    it.open()
    a, b, c = (line(it, name) for name in "abc")
    it.ends({})
    it.tell(Told(Message("the first part"), a, goes_on=True))
    it.tell(Told(Message("the second part"), a))
    it.tell(Done(a))
    it.tell(Told(Message("nobody asked for this")))
    it.ends({"a": "done"})
    it.tell(Done(c, ok=False, refusal=REFUSED))
    it.tell(Refused(REFUSED, b))
    it.tell(Refused(REFUSED))
    it.ends({"a": "done", "b": "refused", "c": "refused"})
    return it.conversation()


def later_server() -> Conversation:
    it = recorder_of("later-server", "types and fields that the client does not know; those with a `seq` count")
    it.open()
    a = line(it, "a")
    it.raw({"type": "weather", "sun": True, "rain": [1, {"mm": 2}]})
    it.tell(Applause(3))
    it.tell(Done(a))
    it.raw({"type": "activity", "driver": "ada", "mood": "good"})
    it.ends({"a": "done"})
    it.cut()
    it.open()
    return it.conversation()


def resumed() -> Conversation:
    it = recorder_of("resumed", "a cut; what was said meanwhile follows; each command has its end")
    it.open()
    a, b = line(it, "a"), line(it, "b")
    it.tell(Done(a))
    line(it, "c", arrives=False)
    it.cut()
    it.tell(Told(Message("while you were away")))
    it.tell(Done(b, ok=False, refusal=REFUSED))
    it.open()
    it.ends({"a": "done", "b": "refused", "c": "refused"})
    d = line(it, "d")
    it.tell(Done(d))
    it.ends({"a": "done", "b": "refused", "c": "refused", "d": "done"})
    return it.conversation()


def lost() -> Conversation:
    it = recorder_of("lost", "messages that the server has sent, and that never came; one command is still under way")
    it.open()
    a, b = line(it, "a"), line(it, "b")
    it.lose(Told(Message("this does not arrive")), Done(a))
    it.cut()
    it.open()
    it.ends({"a": "done"})
    it.tell(Done(b))
    it.ends({"a": "done", "b": "done"})
    return it.conversation()


def forgotten() -> Conversation:
    it = recorder_of("forgotten", "the server was started anew: nobody knows how a command ended", "timeline")
    it.open(full=True)
    it.do(SUBSCRIBE, "changes")
    moved(it.engine, 1)
    it.tell_changes()
    line(it, "a")
    it.cut()
    it.begin_anew(Engine(PUMA))
    it.open(full=True)
    it.ends({"a": "refused"})
    moved(it.engine, 2, 9)
    it.tell_changes()
    it.joints([0.1, 0.5, it.engine.end], EXACT)
    return it.conversation()


def after() -> Conversation:
    it = recorder_of("after", "changes while the line is cut: the client asks for those that it has not", "timeline")
    it.open(full=True)
    it.do(SUBSCRIBE, "changes")
    moved(it.engine, 1)
    it.tell_changes()
    it.cut()
    moved(it.engine, 2, 8)
    it.tell_changes()
    it.open(full=True)
    it.joints([0.1, 0.5, it.engine.end], EXACT)
    return it.conversation()


def questions() -> Conversation:
    it = recorder_of("questions", "questions are open until they are withdrawn, and come again after a cut")
    it.open(attended=True)
    a = line(it, "a")
    it.tell(Asked(1, Confirmation("Are you sure (Y/N)? "), a))
    it.tell(Asked(2, Confirmation("Delete it (Y/N)? "), a))
    it.asked(1, 2)
    it.do({"type": "answer", "question": 1, "value": True})
    it.tell(Withdrawn(2))
    it.asked()
    it.tell(Asked(3, Confirmation("And this (Y/N)? "), a))
    it.cut()
    it.open(attended=True)
    it.asked(3)
    it.do({"type": "answer", "question": 3, "value": False})
    it.tell(Done(a))
    it.asked()
    it.ends({"a": "done"})
    return it.conversation()


def clock() -> Conversation:
    it = recorder_of("clock", "clocks that go, at any rate, stand, and are paused")
    it.open()
    walls = [100.0, 100.5, 130.0]
    it.clock(Clock(7.0, realtime=True, wall=100.0), walls, [7.0, 7.5, 37.0])
    it.clock(Clock(8.0, rate=0.25, realtime=True, wall=100.0), walls, [8.0, 8.125, 15.5])
    it.clock(Clock(9.0, rate=2.0, paused=True, realtime=True, wall=100.0), walls, [9.0, 9.0, 9.0])
    it.clock(Clock(9.5, wall=100.0), walls, [9.5, 9.5, 9.5])
    return it.conversation()


def body() -> Conversation:
    it = recorder_of(
        "body", "a client that is the body: orders and alarms count as all that has a `seq`, also over a cut"
    )
    it.open()
    it.do({"type": "embody", "first": 7, "rate": 100.0}, "body")
    it.tell(Embodied(it.id_of("body"), 7))
    it.tell(BodyOrder(BodyMode.FOLLOWS, 0.0))
    it.lose(BodyOrder(BodyMode.HOLDS, 2.0))
    it.cut()
    it.open()
    it.do({"type": "embody", "first": 9, "rate": 100.0}, "again")
    it.tell(Embodied(it.id_of("again"), 9, BodyMode.HOLDS, 2.0))
    it.tell(BodyStatus(BodySeen("ada", order=BodyMode.HOLDS)))
    it.tell(Alarm(DivergenceAlarm(2.5, 1, 0.1, 0.02, DivergenceCause.BLOCKED, "joint 1 does not move", 2.4)))
    it.tell(BodyReleased())
    a = line(it, "a")
    it.tell(Done(a))
    it.ends({"a": "done"})
    return it.conversation()


def connections() -> Iterator[Conversation]:
    for script in (commands, later_server, resumed, lost, forgotten, after, questions, clock, body):
        yield script()
