"""Messages between a robot and one of its users, in this process or over a connection.

`type`, the lower-case name of its class, tells a message from others; a field that holds its default is not written.
Metres, radians and seconds; times are those of the robot's clock where nothing else is said. What only concerns
connections is in `net/messages.py`.
"""

from __future__ import annotations

from enum import Enum
from types import NoneType
from typing import TYPE_CHECKING, Any, Union, get_args

from msgspec import Struct

from vrs_cli.values import acts, hand  # noqa: F401 (they declare acts)
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.prompt import PromptStatus as Around
from vrs_cli.values.prompt import Suggestion
from vrs_cli.values.questions import Answer as Answered
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Reply
from vrs_cli.values.results import Position
from vrs_cli.values.tagged import Act, RobotAct, UserAct
from vrs_cli.wire import snapshots  # noqa: F401 (it declares an act)
from vrs_cli.wire.records import Count, Name, Number, Text, Time
from vrs_cli.wire.refusal import Refusal

MOST_TIMES = 2000  # of one Positions: 20 ms and more of the server, beside the connections

if TYPE_CHECKING:
    AnyAct = Act[Any]
    Found = Any
else:  # what a reader of messages tells apart: all acts, and what comes of them
    _acts = tuple(sorted((*RobotAct.__subclasses__(), *UserAct.__subclasses__()), key=lambda act: act.__name__))
    _found = dict.fromkeys(get_args(act.__orig_bases__[0])[0] for act in _acts)
    AnyAct = Union[_acts]  # noqa: UP007 (of a tuple)
    Found = Union[tuple(kind for kind in _found if kind is not NoneType)]  # noqa: UP007


class _Typed(Struct, frozen=True, tag_field="type", tag=str.lower, omit_defaults=True):
    """`type` is written before the fields of a message."""


class ClientMessage(_Typed, frozen=True, forbid_unknown_fields=True):
    """What who holds a robot sends. A server refuses what it does not know."""


class ServerMessage(_Typed, frozen=True):
    """What a server sends. A client passes over what it does not know: a later version may have it."""


class Request(ClientMessage, frozen=True):
    """What is answered by a message with the same `id`. The ids of one holder grow."""

    id: Count


class Command(Request, frozen=True, kw_only=True):
    """What is done once, however often it is sent: a known id is answered from memory. `Done` is its answer.

    `until`: a time of the server's clock, as `Clock.wall` and `Pong` show it [s]. A command that arrives later was
    held up on the way; the server refuses it, unless it stops the robot.
    """

    until: Number | None = None


class Numbered(ServerMessage, frozen=True, kw_only=True):
    """What who holds the robot hears exactly once, also over a cut connection. `seq` counts these messages of one
    holder, from 1; the connection fills it in.
    """

    seq: Count = 0


class Result(ServerMessage, frozen=True):
    """What the request with this id has asked for. Who hears none asks again."""

    id: Count


# --- requests ---------------------------------------------------------------------------------------------------------


class Line(Command, frozen=True):
    """A line of the conversation, or lines that were pasted together; `more` of these come in the next message.
    `issued`: when it was given, by the robot's clock as its holder knows it [s].
    """

    text: Text
    issued: Number | None = None
    more: bool = False


class At(Command, frozen=True):
    """An act of the holder. `issued`: when, as in `Line` [s]. `found` of `Done` is what comes of it."""

    act: AnyAct
    issued: Number | None = None


class Abort(Command, frozen=True):
    """The emergency stop: it overtakes all, and who drives does not matter."""


class Interrupt(ClientMessage, frozen=True):
    """Ctrl-C: what this holder waits for is stopped."""


class How(Enum):
    """How a question has ended: by an answer, by Ctrl-C, by the end of the input."""

    ANSWERED = "answered"
    INTERRUPTED = "interrupted"
    ENDED = "ended"


class Answer(ClientMessage, frozen=True):
    """To the question with this number. `Withdrawn` says that it has come. `until`: as in `Command`; the question is
    asked again where the answer arrives later.
    """

    question: Count
    value: Answered = None
    how: How = How.ANSWERED
    until: Number | None = None


class Complete(Request, frozen=True):
    """What may come next after a text; `everything`: also where nothing is begun. `Completed` answers."""

    text: Text
    everything: bool = False


class Check(Request, frozen=True):
    """The mistake in a line that is not sent yet. `Checked` answers."""

    text: Text


class Positions(Request, frozen=True):
    """Where the robot is at these times, 2,000 at most. `Located` answers."""

    times: tuple[Time, ...]


class Get(Request, frozen=True):
    """A file of the robot's folder. `Fetched` answers."""

    name: Name


class LeaseAct(Enum):
    """What a user does with the lease."""

    ACQUIRE = "acquire"
    ASK = "ask"
    GIVE = "give"
    RELEASE = "release"
    RENEW = "renew"


class Drive(Command, frozen=True):
    """Ask for the lease, which says who moves the robot; take, give or release it. `to`: who is given it."""

    act: LeaseAct
    to: Name = ""


# --- what comes of them, and by itself ------------------------------------------------------------------------------


class Refused(Numbered, frozen=True):
    """A message that is not a command was not accepted; `id`: which, where it has one."""

    refusal: Refusal
    id: Count | None = None


class Status(ServerMessage, frozen=True):
    """What stands around a prompt: sent when it changes."""

    around: Around


class Typed(Numbered, frozen=True):
    """What a program TYPEs. `newline`: the line ends with it."""

    text: str
    newline: bool = True


class Told(Numbered, frozen=True):
    """A reply; `id`: to which command, None for what the robot says by itself. `goes_on`: the next `told` has more of
    this long reply; each list of it goes on where it ended here.
    """

    reply: Reply
    id: Count | None = None
    goes_on: bool = False


class Asked(Numbered, frozen=True):
    """The question with this number; `id`: the command that asks it, None for a program."""

    number: Count
    question: Question
    id: Count | None = None


class Withdrawn(Numbered, frozen=True):
    """The question with this number needs no answer any more."""

    number: Count


class Done(Numbered, frozen=True):
    """The command, or the request, with this id has ended. `version` of the timeline: what it has changed is in it.
    `status`: what stands around the prompt then; `found`: what has come of an act.
    """

    id: Count
    ok: bool = True
    refusal: Refusal | None = None
    version: Count = 0
    status: Around | None = None
    found: Found | None = None


class Located(Result, frozen=True):
    """For `Positions`: at these times, by timeline `version`."""

    version: Count
    positions: tuple[Position, ...]


class Completed(Result, frozen=True):
    """For `Complete`."""

    choices: tuple[Suggestion, ...] = ()


class Checked(Result, frozen=True):
    """For `Check`: None where the line has no mistake."""

    mistake: Diagnostic | None = None


class Fetched(Result, frozen=True):
    """For `Get`."""

    name: str
    data: bytes
