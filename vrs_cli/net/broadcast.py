"""Send samples, changes and news (such as the clock) of one robot to many connections.

Each message is encoded once for all connections. No connection waits for another: a slow connection gets no samples,
and its changes wait until it takes data again. So only the bounded buffer of that connection fills up, and after a
stall the connection gets the current state.

Pure: connections are sinks, the wall clock is an argument. The caller asks when there is data to send (`peek`) and
sends a slice of it (`step`). Between two slices the caller does other work, so that a user who gives a command gets the
answer before a thousand viewers get the change.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import islice
from math import inf
from typing import NamedTuple, Protocol

from vrs_cli.engine.approximation import known_tolerance
from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import TimelineReplaced
from vrs_cli.engine.position import Watched
from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces.roles.playback import Audience, Playback, Viewer, checked_rate
from vrs_cli.net import messages
from vrs_cli.net import stream as streams
from vrs_cli.net.course_teller import CourseTeller, Cut, Heard
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.measured import Report
from vrs_cli.values.results import Position

MAX_SAMPLE_RATE = 200.0  # [1/s] maximum rate of samples
MAX_WAITING_BYTES = 256 * 1024  # maximum bytes that wait for one connection
SLICE = 50  # maximum number of listeners served in one step (0.5 ms of CPU time)
HOLD = 0.02  # [s] maximum pause of sending while a user waits for an answer
AGAIN = 0.05  # [s] time between two attempts to send to a slow connection


Letter = Callable[[streams.MessageForm], streams.Packet]  # encodes one message in a requested form, once per form


def letter(message: messages.ServerMessage) -> Letter:
    """Return a function that encodes a message in a requested form, and keeps each encoded form."""
    return cache(partial(streams.packet_of, message))


class Sink(Protocol):
    """A connection that takes packets. Its methods never wait and never raise."""

    @property
    def waiting(self) -> int:
        """Return the number of sent bytes that the receiver has not taken yet."""

    def send(self, *packets: streams.Packet) -> None:
        """Send packets in one write."""


class Parcel(NamedTuple):
    """Packets for all listeners in the same state, sent in one write. `number`, `news`, `place`, `heard` and
    `measured`: the state of the listener after it has received the packets. `alone`: send the packets only if no other
    bytes wait. `whole`: the listener is up to date after the packets."""

    packets: tuple[streams.Packet, ...]
    number: int
    news: int
    place: streams.DeflatedPlace | None
    heard: Heard | None
    measured: int | None
    alone: bool
    whole: bool


class Listener:
    """A connection that receives broadcasts. `number`, `news`: the numbers of the last change and of the last news that
    were sent."""

    def __init__(self, sink: Sink, form: streams.MessageForm, deflates: bool) -> None:
        self.sink, self.form = sink, form
        self.deflates = deflates
        self.listening: streams.Listening | None = None  # form in which changes are sent; None: no changes are sent
        self.number, self.news = NOTHING, 0
        self.place: streams.DeflatedPlace | None = None
        self.heard: Heard | None = None  # part of the world's predicted course sent so far; None: not requested
        self.measured: int | None = None  # number of the next body report to send; None: no reports
        self.channel: Channel | None = None  # the channel of the listener's samples

    def takes(self, parcel: Parcel) -> bool:
        """Send a parcel, unless too many bytes wait; return whether it was sent."""
        waiting = self.sink.waiting
        if waiting and (parcel.alone or waiting + sum([len(it.data) for it in parcel.packets]) > MAX_WAITING_BYTES):
            return False
        if parcel.packets:
            self.sink.send(*parcel.packets)
        self.number, self.news, self.place, self.heard = parcel.number, parcel.news, parcel.place, parcel.heard
        self.measured = parcel.measured
        return True


NOTHING = -1  # the number of a listener that has received nothing yet


class Round:
    """Listeners that are served in turn. `left`: the number of listeners not yet served in this round. A new round
    begins with the listeners that the last round did not reach."""

    def __init__(self) -> None:
        self._order: deque[Listener] = deque()
        self.left = 0

    def __len__(self) -> int:
        return len(self._order)

    def begin(self) -> None:
        self.left = len(self._order)

    def take(self, most: int) -> list[Listener]:
        """Return the next listeners of the round, at most `most`."""
        count = min(most, self.left)
        taken = list(islice(self._order, count))
        self._order.rotate(-count)
        self.left -= count
        return taken

    def add(self, listener: Listener) -> None:
        """Add a listener, which is served from the next round on."""
        self._order.append(listener)

    def remove(self, listener: Listener) -> None:
        self.left -= self._order.index(listener) < self.left
        self._order.remove(listener)


class Channel:
    """A group of listeners that get the same samples: all that follow the robot at one rate, or a single listener with
    its own playback."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer, self.round = viewer, Round()
        self.sample: Letter | None = None
        # for each recent change: from what time on it changed the timeline, and until when samples carry this time [s]
        self._wrong: list[tuple[float, float]] = []

    def change(self, cut: float, applied: float) -> None:
        """Record that the timeline changed from `cut` on, so samples already sent for later times are wrong. As long
        as a viewer may still show one, every new sample carries this time, so listeners that miss some samples also
        learn of the change. `applied`: when the change was made, by the robot's clock [s]."""
        if cut < applied + self.viewer.ahead:
            self._wrong.append((cut, applied + self.viewer.ahead))

    def show(self, position: Position, version: int, clock: float) -> None:
        """Begin to send a new sample. Listeners that have not received the previous sample skip it."""
        self._wrong = [one for one in self._wrong if one[1] > clock]
        wrong = min((cut for cut, _ in self._wrong), default=None)
        self.sample = letter(messages.Sample(position.time, position.joints, version, clock, wrong))
        self.round.begin()

    def serve(self, most: int) -> int:
        """Send the sample to at most `most` listeners; return the number of listeners served."""
        if (sample := self.sample) is None:
            return 0
        turn = self.round.take(most)
        for listener in turn:
            if not listener.sink.waiting:
                listener.sink.send(sample(listener.form))
        return len(turn)


# each function takes the playback, the value in the message, and the wall time [s]
STEPS: Mapping[messages.PlayStep, Callable[[Playback, float, float], Playback]] = {
    messages.PlayStep.PLAY: lambda it, _, wall: it.play(wall),
    messages.PlayStep.PAUSE: lambda it, _, wall: it.pause(wall),
    messages.PlayStep.REWIND: lambda it, _, wall: it.rewind(wall),
    messages.PlayStep.SEEK: lambda it, t, wall: it.seek(t, wall),
    messages.PlayStep.RATE: lambda it, rate, wall: it.at_rate(checked_rate(rate, "times as fast", inf), wall),
}


class Broadcast:
    """A sender of one robot's changes, news and samples to its listeners. `stream`: numbers and encodes the changes.
    `course`: computes the course of the world (parts, sensors and contacts over time); None without a cell."""

    def __init__(
        self,
        watched: Watched,
        begin: TimelineReplaced,
        wall: Callable[[], float],
        state: streams.StateOfWorld | None = None,
        course: CourseTeller | None = None,
    ) -> None:
        self.stream, self.course, self.measured = (
            streams.Stream(begin, watched.arm, state),
            course,
            streams.MeasuredTeller(),
        )
        self._watched, self._wall = watched, wall
        self._everybody = Round()
        self._hearing: dict[Listener, None] = {}  # listeners that receive the states of parts and sensors
        self._measuring: dict[Listener, None] = {}  # listeners that receive the reports of the body
        self._gathered = -inf  # wall time [s] of the last batch of body reports
        self._measured_due = inf  # wall time [s] of the next batch of body reports
        self._behind: dict[Listener, None] = {}  # slow listeners, in the order of the last attempt to send
        self._again = inf  # wall time [s] of the next attempt to send to slow listeners
        self._news: dict[type[messages.ServerMessage], tuple[int, Letter]] = {}
        self._parcel = cache(self._pack)  # parcels by the state of the listener; valid until the next event
        self._last_news = 0
        self._held = self._free = -inf  # wall times [s]: end of the pause of sending, and earliest start of the next
        self._audience = Audience(watched, wall)
        self._channels: dict[Viewer, Channel] = {}
        self._shared: dict[tuple[float, float], Channel] = {}  # channels by rate [1/s] and time ahead of the robot [s]

    # --- listeners ---

    @property
    def is_watched(self) -> bool:
        """Return whether the robot has a user, viewer or publisher."""
        return bool(len(self._everybody))

    def join(self, sink: Sink, form: streams.MessageForm, *, deflates: bool = False) -> Listener:
        """Add a connection, which gets only news until it subscribes."""
        listener = Listener(sink, form, deflates)
        self._everybody.add(listener)
        self._catch_up(listener)
        return listener

    def leave(self, listener: Listener) -> None:
        self._leave_channel(listener)
        self._hear(listener, None)
        self._hear_course(listener, wanted=False)
        self._measuring.pop(listener, None)
        self._behind.pop(listener, None)
        self._everybody.remove(listener)

    def subscribe(self, listener: Listener, wanted: messages.Subscribe) -> None:
        """Subscribe a listener as the message `wanted` describes; this replaces its earlier subscription. Raises
        IllegalValue for a wrong rate or tolerance, RequestRefused for `world` without `deltas`."""
        joints = None if wanted.joints is None else known_tolerance(wanted.joints)
        if wanted.rate:
            checked_rate(wanted.rate, "samples a second", MAX_SAMPLE_RATE)
        if wanted.world and not wanted.deltas:
            raise RequestRefused("world without deltas", "parts are shown on a timeline: ask for deltas too")
        listener.form = listener.form._replace(joints=joints)
        self._leave_channel(listener)
        if wanted.rate:
            self._enter_channel(listener, self._live_channel(wanted.rate, wanted.ahead))
        heard = streams.Listening(listener.form, listener.deflates, wanted.window) if wanted.deltas else None
        self._hear(listener, heard)
        self._hear_course(listener, wanted=wanted.world)
        listener.measured = self.measured.count if wanted.measured else None
        self._measuring.pop(listener, None)
        if wanted.measured:
            self._measuring[listener] = None
        known = wanted.after if wanted.after is not None else NOTHING
        listener.number = known if known <= self.stream.number else NOTHING
        self._catch_up(listener)

    def resync(self, listener: Listener, *, full: bool = False) -> None:
        """Send a snapshot instead of earlier changes. `full`: send all later changes in the full form."""
        listener.form = listener.form._replace(full=full or listener.form.full)
        if listener.listening is not None:
            self._hear(listener, listener.listening._replace(form=listener.form))
        listener.number = NOTHING
        self._catch_up(listener)

    def _hear(self, listener: Listener, listening: streams.Listening | None) -> None:
        """Set the form in which a listener receives all further changes; None: no changes."""
        if listener.listening is not None:
            self.stream.end(listener.listening.form)
        if listening is not None:
            self.stream.begin(listening.form)
        listener.listening = listening

    def _hear_course(self, listener: Listener, *, wanted: bool) -> None:
        """Start or stop sending the course of the world (states of parts and sensors over time) to a listener; the
        course is sent from its beginning."""
        if self.course is None:
            return
        if listener.heard is not None:
            self.course.end()
            del self._hearing[listener]
        listener.heard = Heard() if wanted else None
        if wanted:
            self.course.begin(self.stream.timeline)
            self._hearing[listener] = None

    # --- playback ---

    def play(self, listener: Listener, wish: messages.Play) -> None:
        """Control the playback of a listener. Raises IllegalValue for a wrong rate."""
        if listener.channel is None:
            return
        viewer = listener.channel.viewer
        if wish.step is messages.PlayStep.FOLLOW:
            self._leave_channel(listener)
            self._enter_channel(listener, self._live_channel(viewer.rate, viewer.ahead))
        else:
            viewer = self._own(listener, listener.channel).viewer
            viewer.playback = STEPS[wish.step](viewer.playback, wish.value, self._wall())

    def _live_channel(self, rate: float, ahead: float) -> Channel:
        """Return the channel for following the robot at this rate. If the existing channel is still behind after a jump
        of virtual time, return a new one."""
        shared = self._shared.get((rate, ahead))
        timeline, wall, now = self._watched.timeline, self._wall(), self._watched.now + ahead
        if (
            shared is None
            or shared.viewer.playback.look(wall, timeline.start, timeline.end, now).behind(wall) > 1.0 / rate
        ):
            shared = self._shared[rate, ahead] = self._channel(rate, ahead)
        return shared

    def _own(self, listener: Listener, channel: Channel) -> Channel:
        """Return a channel for this listener only. It continues the playback of the listener's old channel."""
        if len(channel.round) == 1 and channel not in self._shared.values():
            return channel
        own = self._channel(channel.viewer.rate, 0.0)
        own.viewer.playback = channel.viewer.playback
        self._leave_channel(listener)
        self._enter_channel(listener, own)
        return own

    def _channel(self, rate: float, ahead: float) -> Channel:
        channel = Channel(self._audience.join(rate, ahead))
        self._channels[channel.viewer] = channel
        return channel

    def _enter_channel(self, listener: Listener, channel: Channel) -> None:
        listener.channel = channel
        channel.round.add(listener)

    def _leave_channel(self, listener: Listener) -> None:
        channel, listener.channel = listener.channel, None
        if channel is None:
            return
        channel.round.remove(listener)
        if not len(channel.round):
            self._audience.leave(channel.viewer)
            del self._channels[channel.viewer]
            key = channel.viewer.rate, channel.viewer.ahead
            if self._shared.get(key) is channel:
                del self._shared[key]

    # --- events ---

    def tell(self, event: TimelineChange, applied: float) -> None:
        """Begin to send a change of the timeline; `applied`: the robot's clock when it was applied [s]."""
        before = self.stream.timeline
        self.stream.tell(event, applied, self._watched.timeline)
        if self.course is not None and self._hearing:
            cut = Cut.between(before, self.stream.timeline)
            self.course.change(self.stream.timeline, cut)
            for listener in self._hearing:
                listener.heard = listener.heard and listener.heard.cut(cut)
        if isinstance(event, TimelineDelta):
            for channel in self._channels.values():
                channel.change(event.cut, applied)
        self.begin_round()

    def measure(self, reports: Sequence[Report]) -> bool:
        """Take reports of the body; return whether a listener wants them."""
        if not self.measured.take(reports, heard=bool(self._measuring)):
            return False
        self._measured_due = min(self._measured_due, self._gathered + streams.BATCH_PERIOD_S)
        return True

    def announce(self, news: messages.ServerMessage) -> None:
        """Send news to all current and later listeners. A slow listener gets only the last news of each type."""
        self._last_news += 1
        self._news.pop(type(news), None)  # keeps the dictionary in the order of arrival
        self._news[type(news)] = self._last_news, letter(news)
        self.begin_round()

    def begin_round(self) -> None:
        """Begin to send new data to all listeners."""
        self._parcel.cache_clear()
        self._everybody.begin()

    # --- sending, slice by slice ---

    def hold(self) -> None:
        """Send nothing for HOLD seconds or until `release`, because a user waits for an answer. Sending then continues
        for at least as long before the next pause, regardless of the number of waiting users."""
        wall = self._wall()
        if wall >= self._free:
            self._held, self._free = wall + HOLD, wall + 2.0 * HOLD

    def release(self) -> None:
        """Resume sending after the user got the answer."""
        wall = self._wall()
        if self._held > wall:
            self._held, self._free = wall, wall + HOLD - (self._held - wall)

    def peek(self) -> float:
        """Return the wall time [s] at which `step` has work to do; infinity if it waits for an event."""
        is_due = self._everybody.left or any(channel.round.left for channel in self._channels.values())
        due = self._wall() if is_due else min(self._again, self._audience.peek(), self._measured_due)
        return max(due, self._held)

    def step(self) -> None:
        """Compute the samples that are due, and send one slice of the waiting packets."""
        if self._held > self._wall():
            return
        for viewer, version, position in self._audience.step():
            self._channels[viewer].show(position, version, self._watched.now)
        if self._measured_due <= self._wall():
            self._gathered, self._measured_due = self._wall(), inf
            self.measured.gather()
            self.begin_round()
        if self._again <= self._wall():
            for listener in list(islice(self._behind, SLICE)):
                self._catch_up(listener)
            self._again = self._wall() + AGAIN if self._behind else inf
        turn = self._everybody.take(SLICE)
        for listener in turn:
            self._catch_up(listener)
        left = SLICE - len(turn)
        for channel in self._channels.values():
            left -= channel.serve(left)

    def _catch_up(self, listener: Listener) -> None:
        self._behind.pop(listener, None)
        while True:
            it = listener
            parcel = self._parcel(it.number, it.news, it.place, it.heard, it.measured, it.listening, it.form)
            if not listener.takes(parcel):
                break
            if parcel.whole:
                return
        self._behind[listener] = None
        self._again = min(self._again, self._wall() + AGAIN)

    def _pack(
        self,
        number: int,
        news: int,
        place: streams.DeflatedPlace | None,
        heard: Heard | None,
        measured: int | None,
        listening: streams.Listening | None,
        form: streams.MessageForm,
    ) -> Parcel:
        """Return the next parcel for listeners in this state: changes (or a snapshot instead), news, reports of the
        body, and a part of the course of the world. Except for a snapshot, the parcel has at most about
        MAX_WAITING_BYTES."""
        stream, packets, size, alone = self.stream, list[streams.Packet](), 0, False
        while listening is not None and number < stream.number:
            if (packet := stream.after(number, listening, place)) is None:
                missed = 0 if number == NOTHING else stream.count_missed(number)  # number of changes no longer kept
                packets = [streams.packet_of(messages.Missed(missed), form)] if missed else []
                number, packet, alone = stream.number, stream.snapshot(listening, self._watched.now), True
            elif packets and size + len(packet.data) > MAX_WAITING_BYTES:
                return Parcel(tuple(packets), number, news, place, heard, measured, alone, whole=False)
            else:
                number += 1
            packets.append(packet)
            place, size = packet.place or place, size + len(packet.data)
        for last, packet_in in self._news.values():
            if last > news:
                news = last
                packets.append(packet_in(form))
        for batch in () if measured is None else self.measured.after(measured):
            if size > MAX_WAITING_BYTES // 2:
                break
            packets.append(streams.packet_of(batch.message, form))
            measured, size = batch.end, size + len(packets[-1].data)
        whole = size <= MAX_WAITING_BYTES // 2
        if whole and heard is not None and self.course is not None:
            course_news, heard = self.course.after(heard)
            packets += [streams.packet_of(one, form) for one in course_news]
            whole = not course_news
        return Parcel(tuple(packets), number, news, place, heard, measured, alone, whole)
