"""Number, encode and keep the changes of one robot for all listeners of its timeline; gather the reports of its body.

Each change is encoded once, when it is made, in each form that a listener uses or used recently; then only the bytes
are kept. A listener that misses older changes gets a snapshot; all listeners get one when the timeline is replaced.
Pure: no function reads a clock.

A deflated message may refer to earlier messages, if the receiver has them. So each deflated message has a place in a
context: a sequence of messages that must be inflated together. All other messages are sent undeflated, which does not
affect the context of a connection (RFC 7692, 6 and 7.2).
"""

from __future__ import annotations

import zlib
from collections import Counter, deque
from collections.abc import Callable, Sequence
from functools import cache, lru_cache, partial
from itertools import count
from typing import NamedTuple

from msgspec import Struct, field, structs

from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import Snapshot, TimelineReplaced
from vrs_cli.engine.settings import Settings
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.net import messages
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.measured import Report
from vrs_cli.values.world import WorldState
from vrs_cli.wire.codec import Encoding, encode
from vrs_cli.wire.messages import SnapshotRecord, snapshot_record
from vrs_cli.wire.records import Motions, delta_record
from vrs_cli.wire.reports import row_fields, row_parts
from vrs_cli.wire.steered import LinePieces, steered_record

# zlib settings. All listeners share one context, so a full window costs little memory. For changes of timelines, level
# 9 takes up to twice the time of level 6 and saves 2 % of the bytes; level 1 is a third faster, but needs 5 to 20 %
# more bytes.
LEVEL, WINDOW_BITS, MEMORY = 6, 15, 8
_TAIL = 4  # number of bytes at the end of a flush that are not sent (RFC 7692, 7.2.1)
REMEMBERED, REMEMBERED_BYTES = 1000, 256 * 1024  # maximum number of kept changes, and of their bytes
SEGMENTS, SNAPSHOT_BYTES = 1000, 256 * 1024  # maximum size of a snapshot (15 ms of CPU); older segments are left out
NEW_LINES = 40  # maximum number of straight lines for which a snapshot computes new pieces (20 ms of CPU)
MAX_PARTS = 8  # maximum number of encoded parts of the timeline that are kept until the next change

StateOfWorld = Callable[[Timeline, float], WorldState | None]


class MessageForm(NamedTuple):
    """The form of messages. `text`: JSON, otherwise MessagePack; `full`: include values that the receiver could
    compute; `joints`: include pieces of straight lines within this tolerance [rad, m].
    """

    text: bool
    full: bool = False
    joints: float | None = None


class DeflatedPlace(NamedTuple):
    """The place of a deflated message: the number of its context, and its number in this context."""

    context: int
    number: int


class Packet(Struct, eq=False):
    """One encoded message. `place`: set if the data are deflated. `frame`: the WebSocket frame; empty until it is
    built."""

    data: bytes
    text: bool
    place: DeflatedPlace | None = None
    frame: bytes = b""

    def follows(self, last: DeflatedPlace | None) -> bool:
        """Return whether a receiver that has all messages up to the place `last` can inflate this message."""
        place = self.place
        return place is None or place.number == 0 or last == (place.context, place.number - 1)


class DeflateContext:
    """A compressor for a sequence of messages, each of which may refer to earlier messages."""

    _numbers = count()

    def __init__(self) -> None:
        self._number, self._index = next(DeflateContext._numbers), 0
        self._compressor = zlib.compressobj(LEVEL, zlib.DEFLATED, -WINDOW_BITS, MEMORY)

    def deflate(self, packet: Packet) -> Packet:
        data = self._compressor.compress(packet.data) + self._compressor.flush(zlib.Z_SYNC_FLUSH)
        place = DeflatedPlace(self._number, self._index)
        self._index += 1
        return Packet(data[:-_TAIL], packet.text, place)


def packet_of(message: messages.ServerMessage, form: MessageForm) -> Packet:
    """Encode a message in a form."""
    frame = encode(message, Encoding.JSON if form.text else Encoding.MSGPACK)
    return Packet(frame.encode() if isinstance(frame, str) else frame, form.text)


TEXT = MessageForm(text=True)  # the form with the longest messages, used to limit sizes


class Listening(NamedTuple):
    """The way a listener gets changes: their form, whether they are deflated, and the length of the past that it gets
    (`window` [s]; None: all of it)."""

    form: MessageForm
    deflates: bool = False
    window: float | None = None


class _Change(Struct):
    """An encoded change. `packets`: the change in each form; `deflated`: also deflated, in the forms that were
    requested while it was the last change.
    """

    packets: dict[MessageForm, Packet]
    size: int  # total bytes of the packets
    deflated: dict[MessageForm, Packet] = field(default_factory=dict)


class Stream:
    """The encoded changes of one robot. `number`: the number of the last change; `timeline`, `settings`: the state
    after it. `state`: returns the state of the cell just before a time [s] of a timeline; None without a cell."""

    def __init__(self, begin: TimelineReplaced, arm: RobotArm, state: StateOfWorld | None = None) -> None:
        self.number = 0
        self._arm, self._state, self._pieces = arm, state, LinePieces(arm)
        self.timeline: Timeline = begin.timeline
        self.settings: Settings = begin.settings
        self._replaced = 0  # the number of the last change that replaced the timeline
        self._changes: dict[int, _Change] = {}
        self._bytes = 0
        self._listeners: Counter[MessageForm] = Counter()
        # for each form without listeners: the last change that is still encoded in it
        self._encoded_until: dict[MessageForm, int] = {}
        self._contexts: dict[MessageForm, DeflateContext] = {}
        self._snapshots: dict[Listening, Packet] = {}
        self.part = lru_cache(MAX_PARTS)(self._part)  # parts that were requested since the last change

    # --- changes of the robot ---

    def tell(self, event: TimelineChange, applied: float, seen: Timeline) -> None:
        """Take the next change.

        `applied`: the robot's clock when it was applied [s]. `seen`: the robot's current timeline, which may contain
        later changes. Raises ValueError for a change that does not fit.
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
        self.part.cache_clear()

    def _encode(self, delta: TimelineDelta, before: Timeline, applied: float, number: int) -> None:
        """Encode a change in all wanted forms and keep the bytes. If no form is wanted, drop all kept changes."""
        until = self._encoded_until
        for form in [form for form, last in until.items() if last < number and not self._listeners[form]]:
            del until[form]
        if not self._encoded_until:
            self._forget(0)
            return
        change = cache(partial(self._change, delta, before, applied, number))
        packets = {form: packet_of(change(form.full, form.joints), form) for form in self._encoded_until}
        size = sum(len(packet.data) for packet in packets.values())
        self._changes[number] = _Change(packets, size)
        self._bytes += size
        self._forget(REMEMBERED)

    def _change(
        self, delta: TimelineDelta, before: Timeline, applied: float, number: int, full: bool, joints: float | None
    ) -> messages.Change:
        short = None if full else steered_record(delta, before, self._arm)
        if short is not None:
            return messages.Steered(short, number=number)
        return messages.Delta(delta_record(delta, Motions(), self._pieces.within(joints)), applied, number=number)

    def _forget(self, most: int) -> None:
        """Drop the oldest changes, so that at most `most` changes and REMEMBERED_BYTES are kept."""
        while self._changes and (len(self._changes) > most or self._bytes > REMEMBERED_BYTES):
            self._bytes -= self._changes.pop(next(iter(self._changes))).size

    # --- listeners ---

    def begin(self, form: MessageForm) -> None:
        """Add a listener that receives the changes in this form."""
        self._listeners[form] += 1
        self._encoded_until[form] = self.number

    def end(self, form: MessageForm) -> None:
        """Remove one listener of this form. It may return, so later changes are still encoded in its form for a
        while."""
        self._listeners[form] -= 1
        self._encoded_until[form] = self.number + REMEMBERED

    def after(self, number: int, listening: Listening, last: DeflatedPlace | None) -> Packet | None:
        """Return the change after `number`, for a listener that has all deflated messages up to the place `last`; None
        if this change is not kept in the listener's form.
        """
        change = self._changes.get(number + 1)
        packet = None if change is None else change.packets.get(listening.form)
        if change is None or packet is None:
            return None
        if not listening.deflates:
            return packet
        form = listening.form
        if form not in change.deflated and number + 1 == self.number:
            change.deflated[form] = self._contexts.setdefault(form, DeflateContext()).deflate(packet)
        found = change.deflated.get(form, packet)
        if found.follows(last) and found is not packet:
            return found
        self._contexts.pop(form, None)  # so the next deflated message refers to no earlier message
        return packet

    def count_missed(self, number: int) -> int:
        """Return the number of changes, since the timeline was last replaced, that come after number `number`."""
        return max(0, self.number - max(number, self._replaced))

    def snapshot(self, listening: Listening, now: float) -> Packet:
        """Return a snapshot of the timeline, from the start of the listener's window before `now` [s]. It replaces all
        earlier changes.
        """
        if (found := self._snapshots.get(listening)) is None:
            first = 0 if listening.window is None else self.timeline.index_at(now - listening.window)
            _, found = self._last_part(first, len(self.timeline), listening.form)
            found = self._snapshots[listening] = DeflateContext().deflate(found) if listening.deflates else found
        if listening.deflates:
            self._contexts.pop(listening.form, None)
        return found

    def _part(self, begin: float, end: float | None = None, joints: float | None = None) -> SnapshotRecord:
        """Return the timeline from `begin` to `end` [s], or only its last part if it is too long. `joints`: the
        tolerance of pieces of straight lines [rad, m]; None: no pieces.
        """
        after = len(self.timeline) if end is None else self.timeline.index_at(end) + 1
        return self._last_part(self.timeline.index_at(begin), after, TEXT._replace(joints=joints))[0]

    def _last_part(self, first: int, after: int, form: MessageForm) -> tuple[SnapshotRecord, Packet]:
        """Return the segments with numbers from `first` to `after` - 1 and their encoded message. If there are too many
        for a snapshot, return only the last ones.
        """
        pieces = self._pieces.within(form.joints)
        first = max(first, after - SEGMENTS)
        if form.joints is not None:
            known = [self.timeline[index] for index in range(first, after)]
            first = after - self._pieces.count_late(known, form.joints, NEW_LINES)
        snapshot = Snapshot.part(self.timeline, self.settings, first, after)
        while True:
            record = snapshot_record(snapshot, pieces)
            packet = packet_of(messages.Replaced(record, number=self.number), form)
            segments, events = len(snapshot.segments), len(snapshot.events)
            if len(packet.data) <= SNAPSHOT_BYTES or max(segments, events) <= 1:
                break
            if segments > 1:
                first += segments // 2
                snapshot = Snapshot.part(self.timeline, self.settings, first, after)
            else:
                snapshot = snapshot.with_later_events(events // 2)
        state = self._state(self.timeline, snapshot.known_from) if self._state and snapshot.first else None
        if state is not None:
            record = structs.replace(record, world=state)
            packet = packet_of(messages.Replaced(record, number=self.number), form)
        return record, packet


def _follows(timeline: Timeline, delta: TimelineDelta) -> bool:
    """Return whether this delta is the last change of the timeline, so that it need not be applied again."""
    return (
        timeline.version == delta.version + 1
        and bool(delta.segments)
        and len(timeline) > delta.keep
        and timeline[delta.keep].path is delta.segments[0].path
    )


# --- reports of the body ---------------------------------------------------------------------------------------------

BATCH_PERIOD_S = 0.05  # [s] time between two batches of reports
MAX_REMEMBERED = 4000  # maximum number of kept reports; a slow listener misses older ones


class Batch(Struct, frozen=True):
    """A message with reports of the body; `end`: the number of the next report after them."""

    message: messages.Measurements
    end: int


class MeasuredTeller:
    """The newest reports of the body in batches, in the order of arrival. `count`: number of all reports since the
    robot was started."""

    def __init__(self) -> None:
        self.count = 0
        self._fresh: list[Report] = []
        self._batches: deque[Batch] = deque()

    def take(self, reports: Sequence[Report], *, heard: bool) -> bool:
        """Take reports; `heard`: whether a listener wants them. Return whether reports wait for the next batch."""
        self.count += len(reports)
        if heard:
            self._fresh += reports
        return bool(self._fresh)

    def gather(self) -> None:
        """Make batches of the reports that arrived since the last batches."""
        number = self.count - len(self._fresh)
        for part in row_parts(self._fresh):
            self._batches.append(Batch(messages.Measurements(first=number, **row_fields(part)), number + len(part)))
            number += len(part)
        self._fresh = []
        while self._batches and self._batches[0].end < self.count - MAX_REMEMBERED:
            self._batches.popleft()

    def after(self, number: int) -> list[Batch]:
        """Return the batches that contain report `number` or later reports."""
        return [batch for batch in self._batches if batch.end > number]
