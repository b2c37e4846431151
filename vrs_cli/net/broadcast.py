"""One robot told to many connections at once: samples of where it is, its changes, and news such as its clock.

Everything is encoded once for all. Nobody waits for anybody: a connection that does not take what it is sent is left
out of samples, and its place in the changes stays where it is until it takes them again. So nothing queues up but what
the connection itself holds, which is bounded, and what comes after a stall is the present.

Pure: connections are sinks, the wall clock is an argument. Whoever drives it asks when something is due (`peek`) and
does a slice of it (`step`), with other work between two slices: who commands is answered before a thousand others hear.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from itertools import islice
from math import inf
from typing import NamedTuple, Protocol

from vrs_cli.engine.engine import Event
from vrs_cli.engine.position import Watched
from vrs_cli.engine.snapshot import TimelineReplaced
from vrs_cli.interfaces.roles.playback import Audience, Playback, Viewer, checked_rate
from vrs_cli.net import messages
from vrs_cli.net.messages import Play, PlayStep, ServerMessage, Subscribe
from vrs_cli.net.stream import DeflatedPlace, Letter, Listening, MessageForm, Packet, Stream
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.results import Position

HIGHEST_RATE = 200.0  # samples a second
MOST_WAITING = 256 * 1024  # bytes that one connection holds of changes
SLICE = 50  # packets of one step: half a millisecond
HOLD = 0.02  # [s] that sending waits at most for an answer
AGAIN = 0.05  # [s] after which a connection that took nothing is looked at again


class Sink(Protocol):
    """A connection, to whoever sends something. It never waits and never raises."""

    @property
    def waiting(self) -> int:
        """Bytes that were sent and that nobody has taken so far."""

    def send(self, *packets: Packet) -> None:
        """All of them at once."""


class Parcel(NamedTuple):
    """What is to be sent in one write to all who have got the same: the last `number` of a change, of the `news`, and
    `place` are those of who has got it too. `alone`: it goes where nothing else waits; `whole`: nothing comes after it.
    """

    packets: tuple[Packet, ...]
    number: int
    news: int
    place: DeflatedPlace | None
    alone: bool
    whole: bool

    @property
    def size(self) -> int:
        return sum([len(packet.data) for packet in self.packets])


class Listener:
    """One connection. `number`: of the last change that it was sent; `news`: of the last of these."""

    def __init__(self, sink: Sink, form: MessageForm, deflates: bool) -> None:
        self.sink, self.form = sink, form
        self.deflates = deflates
        self.listening: Listening | None = None  # to changes
        self.number, self.news = NOTHING, 0
        self.place: DeflatedPlace | None = None
        self.channel: Channel | None = None  # of samples

    def takes(self, parcel: Parcel) -> bool:
        """Whether it is sent: not where too much waits already; one that is too long goes where nothing else waits."""
        waiting = self.sink.waiting
        if waiting and (parcel.alone or waiting + parcel.size > MOST_WAITING):
            return False
        if parcel.packets:
            self.sink.send(*parcel.packets)
        self.number, self.news, self.place = parcel.number, parcel.news, parcel.place
        return True


NOTHING = -1  # the number of somebody who has got nothing so far


class Round:
    """Listeners to be served one after the other, `left` of them in this round. Who comes last in one that is not
    finished comes first in the next.
    """

    def __init__(self) -> None:
        self._order: deque[Listener] = deque()
        self.left = 0

    def __len__(self) -> int:
        return len(self._order)

    def begin(self) -> None:
        self.left = len(self._order)

    def take(self, most: int) -> list[Listener]:
        """Whose turn it is: so many at most."""
        count = min(most, self.left)
        taken = list(islice(self._order, count))
        self._order.rotate(-count)
        self.left -= count
        return taken

    def add(self, listener: Listener) -> None:
        """From the next round on."""
        self._order.append(listener)

    def remove(self, listener: Listener) -> None:
        self.left -= self._order.index(listener) < self.left
        self._order.remove(listener)


class Channel:
    """Samples for all who see the same: those of one rate who follow the robot, or one with a playback of its own."""

    def __init__(self, viewer: Viewer) -> None:
        self.viewer, self.round = viewer, Round()
        self.sample: Letter | None = None
        self._wrong: list[tuple[float, float]] = []  # cuts of changes, and until when they are told

    def change(self, cut: float, applied: float) -> None:
        """What was shown of times after the cut was wrong. Samples tell of it as long as one that was may count, so
        that who misses some of them hears of it too.
        """
        if cut < applied + self.viewer.ahead:
            self._wrong.append((cut, applied + self.viewer.ahead))

    def show(self, position: Position, version: int, clock: float) -> None:
        """The next sample; who has not got the one before gets this one."""
        self._wrong = [one for one in self._wrong if one[1] > clock]
        wrong = min((cut for cut, _ in self._wrong), default=None)
        self.sample = Letter(lambda _full: messages.Sample(position.time, position.joints, version, clock, wrong))
        self.round.begin()

    def serve(self, most: int) -> int:
        """So many listeners at most; how many it were."""
        sample = self.sample
        if sample is None:
            return 0
        turn = self.round.take(most)
        for listener in turn:
            if not listener.sink.waiting:
                listener.sink.send(sample.packet(listener.form))
        return len(turn)


STEPS: Mapping[PlayStep, Callable[[Playback, float, float], Playback]] = {  # with a value, at a time on the wall
    PlayStep.PLAY: lambda it, _, wall: it.play(wall),
    PlayStep.PAUSE: lambda it, _, wall: it.pause(wall),
    PlayStep.REWIND: lambda it, _, wall: it.rewind(wall),
    PlayStep.SEEK: lambda it, t, wall: it.seek(t, wall),
    PlayStep.RATE: lambda it, rate, wall: it.at_rate(checked_rate(rate, "times as fast", inf), wall),
}


class Broadcast:
    """Tells of one robot. `stream`: its changes."""

    def __init__(self, watched: Watched, begin: TimelineReplaced, wall: Callable[[], float]) -> None:
        self.stream = Stream(begin, watched.arm)
        self._watched, self._wall = watched, wall
        self._everybody = Round()
        self._behind: dict[Listener, None] = {}  # in the order in which they were looked at last
        self._again = inf  # [s] on the wall: when those are looked at again
        self._news: dict[type[ServerMessage], tuple[int, Letter]] = {}
        self._parcels: dict[object, Parcel] = {}  # by what somebody has got, until something happens
        self._last_news = 0
        self._held = self._free = -inf  # [s] on the wall: until when nothing is sent, and is not held again
        self._audience = Audience(watched, wall)
        self._channels: dict[Viewer, Channel] = {}
        self._shared: dict[tuple[float, float], Channel] = {}  # by rate, and how far ahead

    # --- who listens ---

    @property
    def watched(self) -> bool:
        """Whether anybody holds the robot, watches it, or passes it on."""
        return bool(len(self._everybody))

    def join(self, sink: Sink, form: MessageForm, *, deflates: bool = False) -> Listener:
        """One more connection: it hears news, and nothing else so far."""
        listener = Listener(sink, form, deflates)
        self._everybody.add(listener)
        self._catch_up(listener)
        return listener

    def leave(self, listener: Listener) -> None:
        self._leave_channel(listener)
        self._hear(listener, None)
        self._behind.pop(listener, None)
        self._everybody.remove(listener)

    def subscribe(self, listener: Listener, wanted: Subscribe) -> None:
        """Hear this from now on, in place of what was before. Raises IllegalValue for a rate that is none."""
        if wanted.rate:
            checked_rate(wanted.rate, "samples a second", HIGHEST_RATE)
        self._leave_channel(listener)
        if wanted.rate:
            self._enter_channel(listener, self._following(wanted.rate, wanted.ahead))
        heard = Listening(listener.form, listener.deflates, wanted.window) if wanted.deltas else None
        self._hear(listener, heard)
        known = wanted.after if wanted.after is not None else NOTHING
        listener.number = known if known <= self.stream.number else NOTHING
        self._catch_up(listener)

    def resync(self, listener: Listener, *, full: bool = False) -> None:
        """Hear a snapshot, in place of what was heard; if `full`, everything in the full form from now on."""
        listener.form = listener.form._replace(full=full or listener.form.full)
        if listener.listening is not None:
            self._hear(listener, listener.listening._replace(form=listener.form))
        listener.number = NOTHING
        self._catch_up(listener)

    def _hear(self, listener: Listener, listening: Listening | None) -> None:
        """Let a listener hear changes so from now on; None: not at all."""
        if listener.listening is not None:
            self.stream.end(listener.listening.form)
        if listening is not None:
            self.stream.begin(listening.form)
        listener.listening = listening

    # --- who plays ---

    def play(self, listener: Listener, wish: Play) -> None:
        """Show it another time of the timeline, or at another rate. Raises IllegalValue for a rate that is none."""
        if listener.channel is None:
            return
        viewer = listener.channel.viewer
        if wish.step is PlayStep.FOLLOW:
            self._leave_channel(listener)
            self._enter_channel(listener, self._following(viewer.rate, viewer.ahead))
        else:
            viewer = self._own(listener, listener.channel).viewer
            viewer.playback = STEPS[wish.step](viewer.playback, wish.value, self._wall())

    def _following(self, rate: float, ahead: float) -> Channel:
        """The samples of those who follow the robot; new ones where the others are still behind it, as virtual time
        has jumped.
        """
        shared = self._shared.get((rate, ahead))
        timeline, wall, now = self._watched.timeline, self._wall(), self._watched.now + ahead
        if (
            shared is None
            or shared.viewer.playback.look(wall, timeline.start, timeline.end, now).behind(wall) > 1.0 / rate
        ):
            shared = self._shared[rate, ahead] = self._channel(rate, ahead)
        return shared

    def _own(self, listener: Listener, channel: Channel) -> Channel:
        """Samples for one who goes on alone from where all others of its channel are."""
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

    # --- what happens ---

    def tell(self, event: Event, applied: float) -> None:
        """The timeline has changed; the robot's clock was at `applied` [s] then."""
        self.stream.tell(event, applied, self._watched.timeline)
        if isinstance(event, TimelineDelta):
            for channel in self._channels.values():
                channel.change(event.cut, applied)
        self._begin_round()

    def announce(self, news: ServerMessage) -> None:
        """All hear this, and who comes later too; who does not take it hears later the last of its type."""
        self._last_news += 1
        self._news.pop(type(news), None)  # so that they stand in the order in which they came
        self._news[type(news)] = self._last_news, Letter(lambda _full: news)
        self._begin_round()

    def _begin_round(self) -> None:
        self._parcels.clear()
        self._everybody.begin()

    # --- sending, slice by slice ---

    def hold(self) -> None:
        """Somebody waits for an answer, which comes first: nothing is sent for HOLD seconds, or until `release`. Then
        it is sent for as long as it was held, however many wait for answers.
        """
        wall = self._wall()
        if wall >= self._free:
            self._held, self._free = wall + HOLD, wall + 2.0 * HOLD

    def release(self) -> None:
        wall = self._wall()
        if self._held > wall:
            self._held, self._free = wall, wall + HOLD - (self._held - wall)

    def peek(self) -> float:
        """When something is to be sent, on the wall [s]; infinity where nothing is until something happens."""
        return max(self._due(), self._held)

    def _due(self) -> float:
        if self._everybody.left or any(channel.round.left for channel in self._channels.values()):
            return self._wall()
        return min(self._again, self._audience.peek())

    def step(self) -> None:
        """Look where the robot is, if somebody is to see it now, and send a slice of what is to be sent."""
        if self._held > self._wall():
            return
        for viewer, version, position in self._audience.step():
            self._channels[viewer].show(position, version, self._watched.now)
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
        while listener.takes(parcel := self._parcel(listener)):
            if parcel.whole:
                return
        self._behind[listener] = None
        self._again = min(self._again, self._wall() + AGAIN)

    def _parcel(self, listener: Listener) -> Parcel:
        """What it has not got."""
        got = listener.number, listener.news, listener.place, listener.listening, listener.form
        parcel = self._parcels.get(got)
        if parcel is None:
            parcel = self._parcels[got] = self._packed(*got)
        return parcel

    def _packed(
        self, number: int, news: int, place: DeflatedPlace | None, listening: Listening | None, form: MessageForm
    ) -> Parcel:
        """Changes, or a snapshot in their place, then news; no more than may wait."""
        stream, packets, size, alone = self.stream, list[Packet](), 0, False
        while listening is not None and number < stream.number:
            packet = stream.after(number, listening, place)
            if packet is None:
                missed = 0 if number == NOTHING else stream.missed(number)  # changes that are forgotten
                packets = [Letter(lambda _full, count=missed: messages.Missed(count)).packet(form)] if missed else []  # type: ignore[misc]
                number, packet, alone = stream.number, stream.snapshot(listening, self._watched.now), True
            elif packets and size + len(packet.data) > MOST_WAITING:
                return Parcel(tuple(packets), number, news, place, alone, whole=False)
            else:
                number += 1
            packets.append(packet)
            place, size = packet.place or place, size + len(packet.data)
        for last, letter in self._news.values():
            if last > news:
                news = last
                packets.append(letter.packet(form))
        return Parcel(tuple(packets), number, news, place, alone, whole=True)
