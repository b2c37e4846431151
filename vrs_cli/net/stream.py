"""The changes of one robot for everybody who follows its timeline: numbered, encoded and remembered.

A change is encoded once, when it happens, in each form that somebody hears or heard a short while ago; then only its
bytes are kept. Somebody who is behind all remembered changes gets a snapshot; so does everybody when another timeline
replaces this one. Pure: nothing here reads a clock.

A deflated message may refer back to the messages before it, if the receiver has got them too. So each deflated message
has its place in a context: a run of messages that are only useful together. All other messages are sent as they are,
which leaves the context of a connection alone (RFC 7692, 6 and 7.2).
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import NamedTuple

from msgspec import Struct, field

from vrs_cli.engine.engine import Event
from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Snapshot, TimelineReplaced
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.net import messages
from vrs_cli.net.messages import ServerMessage
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.wire.codec import Encoding, encode
from vrs_cli.wire.records import Motions, delta_record
from vrs_cli.wire.snapshots import SnapshotRecord, snapshot_record
from vrs_cli.wire.steered import steered_record

# One context serves all, so its memory costs nothing: a full window. For what robots do, level 9 takes up to twice as
# long as 6 for 2 % fewer bytes, and level 1 is a third faster for 5 to 20 % more.
LEVEL, WINDOW_BITS, MEMORY = 6, 15, 8
_TAIL = 4  # bytes at the end of what is flushed that a frame does not carry (RFC 7692, 7.2.1)
REMEMBERED, REMEMBERED_BYTES = 1000, 256 * 1024  # changes
SEGMENTS, SNAPSHOT_BYTES = 1000, 256 * 1024  # of a snapshot (15 ms of CPU), which begins later rather than to have more
MAX_PARTS = 8  # that are remembered until the next change


class MessageForm(NamedTuple):
    """How somebody hears messages: as text (JSON) or MessagePack; `full`: with what it cannot compute by itself."""

    text: bool
    full: bool = False


class DeflatedPlace(NamedTuple):
    """Of something deflated: in the context with this number, after so many others."""

    context: int
    number: int


class Packet(Struct, eq=False):
    """One message as bytes. `place`: where it is deflated. `frame`: the same as a frame, once somebody has made one."""

    data: bytes
    text: bool
    place: DeflatedPlace | None = None
    frame: bytes = b""

    def follows(self, last: DeflatedPlace | None) -> bool:
        """Whether somebody can inflate it who has got what is at the place `last`, and all before that."""
        place = self.place
        return place is None or place.number == 0 or last == (place.context, place.number - 1)


class DeflateContext:
    """Deflates messages, each with a look back at those before it."""

    _numbers = count()

    def __init__(self) -> None:
        self._number, self._index = next(DeflateContext._numbers), 0
        self._compressor = zlib.compressobj(LEVEL, zlib.DEFLATED, -WINDOW_BITS, MEMORY)

    def deflated(self, packet: Packet) -> Packet:
        data = self._compressor.compress(packet.data) + self._compressor.flush(zlib.Z_SYNC_FLUSH)
        place = DeflatedPlace(self._number, self._index)
        self._index += 1
        return Packet(data[:-_TAIL], packet.text, place)


class Letter:
    """A message to many. `make`: the message, full or not. `size`: of all the bytes that have been made of it."""

    def __init__(self, make: Callable[[bool], ServerMessage]) -> None:
        self._make = make
        self._packets: dict[MessageForm, Packet] = {}
        self.size = 0

    def packet(self, form: MessageForm) -> Packet:
        found = self._packets.get(form)
        if found is None:
            frame = encode(self._make(form.full), Encoding.JSON if form.text else Encoding.MSGPACK)
            found = self._packets[form] = Packet(frame.encode() if isinstance(frame, str) else frame, form.text)
            self.size += len(found.data)
        return found


TEXT = MessageForm(text=True)  # the longest form


class Listening(NamedTuple):
    """How somebody hears changes: in which form, deflated or not, and the last how many seconds of them (None: all)."""

    form: MessageForm
    deflates: bool = False
    window: float | None = None


class TimelinePart(NamedTuple):
    """Some segments of the timeline, and the same as messages have them."""

    snapshot: Snapshot
    record: SnapshotRecord


class _Change(Struct):
    """A change in the forms in which it was encoded; `deflated` in those in which somebody wanted it while it was the
    last.
    """

    packets: dict[MessageForm, Packet]
    size: int  # bytes of the packets
    deflated: dict[MessageForm, Packet] = field(default_factory=dict)


class Stream:
    """`number`: of the last change; `timeline` and `settings`: as they are after it."""

    def __init__(self, begin: TimelineReplaced, arm: RobotArm) -> None:
        self.number = 0
        self._arm = arm
        self.timeline: Timeline = begin.timeline
        self.settings: Settings = begin.settings
        self._replaced = 0  # the last change that was another timeline
        self._changes: dict[int, _Change] = {}
        self._bytes = 0
        self._listeners: Counter[MessageForm] = Counter()
        self._encoded_until: dict[MessageForm, int] = {}  # by form; this matters where nobody hears it
        self._contexts: dict[MessageForm, DeflateContext] = {}
        self._snapshots: dict[Listening, Packet] = {}
        self._parts: dict[tuple[float, float | None], TimelinePart] = {}  # those asked for since the last change

    # --- the robot tells ---

    def tell(self, event: Event, applied: float, seen: Timeline) -> None:
        """The next change; the robot's clock was at `applied` [s] then, and its timeline is `seen` now, perhaps after
        more changes. Raises ValueError for one that does not fit.
        """
        number = self.number + 1
        if isinstance(event, TimelineReplaced):
            self.timeline, self.settings, self._replaced = event.timeline, event.settings, number
            self._forget(0)
        else:
            before, self.timeline = self.timeline, seen if _follows(seen, event) else self.timeline.apply(event)
            self._encode(event, before, applied, number)
        self.number = number
        self._snapshots.clear()
        self._parts.clear()

    def _encode(self, delta: TimelineDelta, before: Timeline, applied: float, number: int) -> None:
        """Encode a change in all forms that are heard, and remember its bytes; in no form: remember nothing."""
        until = self._encoded_until
        for form in [form for form, last in until.items() if last < number and not self._listeners[form]]:
            del until[form]
        if not self._encoded_until:
            self._forget(0)
            return
        letter = Letter(partial(self._change, delta, before, applied, number))
        packets = {form: letter.packet(form) for form in self._encoded_until}
        self._changes[number] = _Change(packets, letter.size)
        self._bytes += letter.size
        self._forget(REMEMBERED)

    def _change(
        self, delta: TimelineDelta, before: Timeline, applied: float, number: int, full: bool
    ) -> messages.Change:
        short = None if full else steered_record(delta, before, self._arm)
        if short is not None:
            return messages.Steered(short, number=number)
        return messages.Delta(delta_record(delta, Motions()), applied, number=number)

    def _forget(self, most: int) -> None:
        """The oldest, so that so many are left."""
        while self._changes and (len(self._changes) > most or self._bytes > REMEMBERED_BYTES):
            self._bytes -= self._changes.pop(next(iter(self._changes))).size

    # --- somebody hears ---

    def begin(self, form: MessageForm) -> None:
        """One more listener hears changes in this form."""
        self._listeners[form] += 1
        self._encoded_until[form] = self.number

    def end(self, form: MessageForm) -> None:
        """A listener of this form is gone. It may come back: the next changes are encoded as if it were there."""
        self._listeners[form] -= 1
        self._encoded_until[form] = self.number + REMEMBERED

    def after(self, number: int, listening: Listening, last: DeflatedPlace | None) -> Packet | None:
        """The change after that number, for somebody who has got what was deflated up to the place `last`; None where
        it is not remembered in that form.
        """
        change = self._changes.get(number + 1)
        packet = None if change is None else change.packets.get(listening.form)
        if change is None or packet is None:
            return None
        return self._deflated(number + 1, change, packet, listening.form, last) if listening.deflates else packet

    def _deflated(
        self, number: int, change: _Change, packet: Packet, form: MessageForm, last: DeflatedPlace | None
    ) -> Packet:
        """A change deflated, if it is or can be, and follows on what somebody has got. Who gets it as it is can take
        what is deflated next.
        """
        if form not in change.deflated and number == self.number:
            change.deflated[form] = self._contexts.setdefault(form, DeflateContext()).deflated(packet)
        found = change.deflated.get(form, packet)
        if found.follows(last) and found is not packet:
            return found
        self._contexts.pop(form, None)
        return packet

    def missed(self, number: int) -> int:
        """How many changes somebody has not got, of the timeline that there is."""
        return max(0, self.number - max(number, self._replaced))

    def snapshot(self, listening: Listening, now: float) -> Packet:
        """All up to now, in place of what was before: in the window before `now` [s], and after it."""
        window, found = listening.window, self._snapshots.get(listening)
        if found is None:
            first = 0 if window is None else self.timeline.index_at(now - window)
            found = self._last_part(first, len(self.timeline), listening.form)[1]
            found = self._snapshots[listening] = DeflateContext().deflated(found) if listening.deflates else found
        if listening.deflates:
            self._contexts.pop(listening.form, None)
        return found

    def part(self, begin: float, end: float | None = None) -> TimelinePart:
        """The timeline from `begin` to `end` [s]; where that is too much, its last part."""
        timeline, found = self.timeline, self._parts.get((begin, end))
        if found is None:
            after = len(timeline) if end is None else timeline.index_at(end) + 1
            found = self._last_part(timeline.index_at(begin), after, TEXT)[0]
            if len(self._parts) >= MAX_PARTS:
                self._parts.clear()
            self._parts[begin, end] = found
        return found

    def _last_part(self, first: int, after: int, form: MessageForm) -> tuple[TimelinePart, Packet]:
        """The segments from one number to before another: so many of the last ones as a snapshot may have."""
        first = max(first, after - SEGMENTS)
        segments = tuple([self.timeline[index] for index in range(first, after)])
        while True:
            snapshot = Snapshot(self.timeline.version, segments, self.settings, first)
            record = snapshot_record(snapshot)
            packet = Letter(lambda _full, it=record: messages.Replaced(it, number=self.number)).packet(form)  # type: ignore[misc]
            if len(packet.data) <= SNAPSHOT_BYTES or len(segments) <= 1:
                return TimelinePart(snapshot, record), packet
            half = len(segments) // 2
            first, segments = first + half, segments[half:]


def _follows(timeline: Timeline, delta: TimelineDelta) -> bool:
    """Whether a timeline is what this delta has made. Then its rows are those that leave memory when they are old."""
    if timeline.version != delta.version + 1 or not delta.segments:
        return False
    return len(timeline) > delta.keep and timeline[delta.keep].path is delta.segments[0].path
