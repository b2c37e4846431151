"""Messages between a robot and one of its users, in this process or over a connection.

The key `type` holds the lower-case name of a message's class. Fields with default values are omitted. Units are metres,
radians and seconds; times are those of the robot's clock unless the field says otherwise. Messages that only
connections need are in `net/messages.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Final, Union, get_args

from msgspec import UNSET, Meta, Struct, UnsetType, structs

from vrs_cli import errors
from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import Place, ProgramError, VrsError, sentence
from vrs_cli.values import acts, hand  # noqa: F401 (they declare acts)
from vrs_cli.values.acts import Sketch
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.questions import Answer as Answered
from vrs_cli.values.questions import PromptStatus as Around
from vrs_cli.values.questions import Question, Suggestion
from vrs_cli.values.replies import Reply, StyledLine
from vrs_cli.values.results import Act, Position, RobotAct, TaggedValue, UserAct
from vrs_cli.values.world import WorldState
from vrs_cli.wire.records import (
    Count,
    EventRecord,
    Form,
    Motions,
    Name,
    Number,
    Pieces,
    SegmentRecord,
    Text,
    Time,
    event_records,
    events_of,
    no_pieces,
    segment_records,
    segments_of,
)


class SnapshotRecord(Struct, frozen=True):
    """A snapshot (the timeline at one version, or its end) as a record. `first`: the number of left out segments."""

    version: Count
    segments: Annotated[tuple[SegmentRecord, ...], Meta(min_length=1)]
    settings: Settings
    first: Count = 0
    events: tuple[EventRecord, ...] | UnsetType = UNSET  # absent if empty, to give the same bytes as older versions
    values: tuple[EventRecord, ...] | UnsetType = UNSET
    first_event: Count | UnsetType = UNSET
    world: WorldState | UnsetType = UNSET


def snapshot_record(snapshot: Snapshot, pieces: Pieces = no_pieces) -> SnapshotRecord:
    """Convert a snapshot to a record."""
    return SnapshotRecord(
        snapshot.version,
        segment_records(snapshot.segments, Motions(), None, pieces),
        snapshot.settings,
        snapshot.first,
        event_records(snapshot.events) or UNSET,
        event_records(snapshot.values) or UNSET,
        snapshot.first_event or UNSET,
        snapshot.world or UNSET,
    )


def snapshot_of(record: SnapshotRecord, form: Form) -> Snapshot:
    """Convert a record to a snapshot. Raises RecordError."""
    segments = segments_of(record.segments, Motions(), None, form)
    events, values = (() if one is UNSET else events_of(one) for one in (record.events, record.values))
    first_event = 0 if record.first_event is UNSET else record.first_event
    world = None if record.world is UNSET else record.world
    return Snapshot(record.version, segments, record.settings, record.first, events, values, first_event, world)


class BranchShown(TaggedValue, frozen=True):
    """The timeline of a branch."""

    snapshot: SnapshotRecord


class ShowBranch(RobotAct[BranchShown], frozen=True):
    """Return the timeline of a branch; `joints` [rad, m]: also send straight lines as `pieces` in joint space with at
    most this error, as for `subscribe`. Raises UsageError for an unknown name, and IllegalValue.
    """

    name: str
    joints: Number | None = None


MAX_TIMES = 2000  # maximum number of times in one Positions, which keeps the server busy for 20 ms or more

if TYPE_CHECKING:
    AnyAct = Act[Any]
    Found = Any
else:  # the unions of all acts and of all results of acts, which the reader of messages decodes
    _acts = tuple(sorted((*RobotAct.__subclasses__(), *UserAct.__subclasses__()), key=lambda act: act.__name__))
    _found = dict.fromkeys(get_args(act.__orig_bases__[0])[0] for act in _acts)
    AnyAct = Union[_acts]  # noqa: UP007 (a union made from a tuple)
    Found = Union[tuple(kind for kind in _found if kind is not NoneType)]  # noqa: UP007 (a union made from a tuple)


class _Typed(Struct, frozen=True, tag_field="type", tag=str.lower, omit_defaults=True):
    """A message: a struct that is written with its `type` before its fields."""


class ClientMessage(_Typed, frozen=True, forbid_unknown_fields=True):
    """A message from a client. A server refuses types and fields that it does not know."""


class ServerMessage(_Typed, frozen=True):
    """A message from a server. A client ignores types and fields that it does not know; later versions add some."""


class Request(ClientMessage, frozen=True):
    """A message that is answered by a message with the same `id`. The ids of a client increase."""

    id: Count


class Command(Request, frozen=True, kw_only=True):
    """A request that is executed once, even if it is sent several times: the server answers a known `id` from memory.
    The answer is `done`.

    `until`: the latest arrival, by the server's clock (`wall` of `clock`, `came` of `pong`) [s]. The server refuses a
    command that arrives later, unless it stops the robot.
    """

    until: Number | None = None


class Numbered(ServerMessage, frozen=True, kw_only=True):
    """A message that the client gets exactly once, even if the connection is cut in between. `seq` counts these
    messages of one client session from 1; the connection fills it in.
    """

    seq: Count = 0


class Result(ServerMessage, frozen=True):
    """The answer to the request with this `id`. If the connection is cut before the answer, the client repeats the
    request."""

    id: Count


# --- requests ---------------------------------------------------------------------------------------------------------


class Line(Command, frozen=True):
    """A line of VAL-II, or several lines that were pasted together; `more`: the next message contains more of these
    lines. `issued` [s]: the time at which the user sent the line, by the client's estimate of the robot's clock."""

    text: Text
    issued: Number | None = None
    more: bool = False


class At(Command, frozen=True):
    """An act: a command as a value instead of a line of text, such as `{"kind":"Go",...}` for a motion or
    `{"kind":"Undo","count":1}`. The JSON Schema lists all kinds. `issued` [s]: the time at which the user sent the act,
    by the client's estimate of the robot's clock. `found` of `done` holds the result.
    """

    act: AnyAct
    issued: Number | None = None


class Abort(Command, frozen=True):
    """The emergency stop. It is executed before all waiting requests, and needs no lease."""


class Interrupt(ClientMessage, frozen=True):
    """Ctrl-C: stop the command that this client waits for."""


class How(Enum):
    """How a question ended: by an answer, by Ctrl-C, or because there is no more input."""

    ANSWERED = "answered"
    INTERRUPTED = "interrupted"
    ENDED = "ended"


class Answer(ClientMessage, frozen=True):
    """The answer to the question that `asked` sent with this number; `withdrawn` confirms it. `until`: the latest
    arrival by the server's clock [s]; if the answer arrives later, the question is asked again."""

    question: Count
    value: Answered = None
    how: How = How.ANSWERED
    until: Number | None = None


class Complete(Request, frozen=True):
    """Request the possible continuations of the typed text. `everything`: list the choices even where no word has been
    started. The answer is `completed`."""

    text: Text
    everything: bool = False


class Check(Request, frozen=True):
    """Ask for the first mistake in a line that the user has not yet sent. The answer is `checked`."""

    text: Text


class Positions(Request, frozen=True):
    """Request the position of the robot at these times [s]; more than 2,000 are refused. The answer is `located`."""

    times: tuple[Time, ...]


class Get(Request, frozen=True):
    """Request a file of the robot's folder. The answer is `fetched`."""

    name: Name


class LeaseAct(Enum):
    """The actions on the lease, the right to move the robot."""

    ACQUIRE = "acquire"
    ASK = "ask"
    GIVE = "give"
    RELEASE = "release"
    RENEW = "renew"


class Drive(Command, frozen=True):
    """Take, request, give, release or renew the lease, the right to move the robot. `to`: the client that gets it."""

    act: LeaseAct
    to: Name = ""


# --- answers, and messages without a request ------------------------------------------------------------------------


class Refused(Numbered, frozen=True):
    """The server's refusal of a message; `id`: the id of the message, if it has one."""

    refusal: Refusal
    id: Count | None = None


class Status(ServerMessage, frozen=True):
    """The values that a prompt shows beside the typed text: clock, speed, program, position. Sent when they change."""

    around: Around


class Typed(Numbered, frozen=True):
    """Text that a program prints with TYPE. `newline`: the line ends after the text."""

    text: str
    newline: bool = True


class Told(Numbered, frozen=True):
    """A reply to the command `id`, or a message of the robot itself (no `id`). `goes_on`: the next `told` has more of
    this long reply; append each of its lists to the list of the same name here. For a client that has `rendered` in its
    `hello`, `lines` is the reply as lines of styled pieces of text, and `sketch` is the picture of an explanation."""

    reply: Reply
    id: Count | None = None
    goes_on: bool = False
    lines: tuple[StyledLine, ...] = ()
    sketch: Sketch | None = None


class Asked(Numbered, frozen=True):
    """A question with its number. `id`: the command that asks it; absent if a program asks."""

    number: Count
    question: Question
    id: Count | None = None


class Withdrawn(Numbered, frozen=True):
    """The question with this number was answered, or no longer needs an answer."""

    number: Count


class Done(Numbered, frozen=True):
    """The command or request with this `id` has ended. `version`: the version of the timeline that contains its
    changes. `status`: the values that a prompt shows after it, as in the message `status`; `found`: the result of an
    act."""

    id: Count
    ok: bool = True
    refusal: Refusal | None = None
    version: Count = 0
    status: Around | None = None
    found: Found | None = None


class Located(Result, frozen=True):
    """The answer to `positions`: one position for each time, in the same order, according to timeline `version`."""

    version: Count
    positions: tuple[Position, ...]


class Completed(Result, frozen=True):
    """The answer to `complete`."""

    choices: tuple[Suggestion, ...] = ()


class Checked(Result, frozen=True):
    """The answer to `check`: the first mistake, absent if there is none."""

    mistake: Diagnostic | None = None


class Fetched(Result, frozen=True):
    """The answer to `get`, and to `collect`."""

    name: str
    data: bytes


class Refusal(Struct, frozen=True):
    """An error as a value, with its numbers. `message`: the sentence for the user."""

    code: int
    title: str
    message: str
    detail: str = ""
    hint: str = ""
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    joint: int = 0
    place: Place | None = None
    in_python: str = ""

    @classmethod
    def of(cls, error: VrsError) -> Refusal:
        told: dict[str, Any] = error.numbers
        return cls(error.code, error.title, str(error), error.detail, error.hint, in_python=error.in_python, **told)

    def error(self) -> VrsError:
        """Recreate the error with its class, message and numbers."""
        kind = _KIND_OF_CODE.get(self.code, VrsError)
        told = {name: getattr(self, name) for name in ("value", "lower", "upper", "joint", "place")}
        made = kind(self.detail, self.hint, in_python=self.in_python, **told)
        return made if str(made) == self.message else Quoted(self)


class Quoted(ProgramError):
    """The error of a refusal whose message cannot be rebuilt from its fields, for example for a line that cannot be
    read."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.detail, refusal.hint, in_python=refusal.in_python)
        self.refusal: Final = refusal

    def for_python(self) -> VrsError:
        said = sentence(self.title, self.detail, self.in_python)
        return Quoted(structs.replace(self.refusal, message=said)) if self.in_python else self

    def __str__(self) -> str:
        return self.refusal.message

    @property
    def title(self) -> str:
        return self.refusal.title


_KIND_OF_CODE: Mapping[int, type[VrsError]] = {
    kind.code: kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and issubclass(kind, VrsError) and "code" in vars(kind)
}
