"""Frames for one user: those that wait for the socket (`Outbox`), and all that a server remembers while the connection
is cut (`DeliveryLog`): messages, commands and questions. Both are bounded. Pure: the time of the day is passed in.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import inf

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.net.messages import Asked, Clock, Done, Numbered, Outcome, Sample, Status, Withdrawn
from vrs_cli.wire.codec import Encoding, Frame, encode

SHORT = 400  # characters of a refusal that is remembered


class Bounds(Struct, frozen=True):
    """How long a user is remembered after a cut [s]; bytes of the messages; the number of commands that have ended, and
    of those that have not.
    """

    seconds: float = 60.0
    told: int = 1_000_000
    ended: int = 1000
    waiting: int = 1000


USUAL = Bounds()


class DeliveryLog:
    """`key` resumes the user's connection: whoever knows it is taken for the user. `seq`: the number of the last
    message to the user. `put`: gives a frame to the connection that is open. `waiting`: the ids of commands that have
    not ended. `ended`: how the others ended, by id. `questions`: those without an answer, by number.
    """

    def __init__(self, key: str, bounds: Bounds = USUAL) -> None:
        self.key, self.bounds = key, bounds
        self.encoding = Encoding.JSON
        self.seq = 0
        self.put: Callable[[Frame], None] | None = None
        self._since: float | None = None  # when its connection was cut
        self._told: deque[tuple[float, Frame]] = deque()  # when, and what: the last of them has the number `seq`
        self._size = 0
        self.waiting: set[int] = set()
        self.ended: dict[int, Done] = {}
        self._forgotten = -1  # the highest id of a command whose end is forgotten
        self.questions: dict[int, Asked] = {}

    # --- messages ---

    def tell(self, message: Numbered, now: float) -> None:
        """Send a message, now or when the connection is resumed."""
        match message:
            case Done(id) if id in self.waiting:
                self.waiting.remove(id)
                short = message.refusal and replace(
                    message.refusal, message=message.refusal.message[:SHORT], detail="", hint=""
                )
                self.ended[id] = Done(id, message.ok, short, message.version)
                if len(self.ended) > self.bounds.ended:
                    oldest = next(iter(self.ended))
                    del self.ended[oldest]
                    self._forgotten = max(self._forgotten, oldest)
            case Asked(number):
                self.questions[number] = message
            case Withdrawn(number):
                self.questions.pop(number, None)
        self.seq += 1
        frame = encode(replace(message, seq=self.seq), self.encoding)
        self._told.append((now, frame))
        self._size += len(frame) + BESIDE
        earliest = (now if self._since is None else self._since) - self.bounds.seconds
        while self._told and (self._told[0][0] < earliest or self._size > self.bounds.told):
            self._size -= len(self._told.popleft()[1]) + BESIDE
        if self.put is not None:
            self.put(frame)

    def since(self, seq: int) -> list[Frame] | None:
        """Return the frames after that number; None if they are not all remembered."""
        missed = self.seq - seq
        if not 0 <= missed <= len(self._told):
            return None
        return [frame for _, frame in list(self._told)[len(self._told) - missed :]]

    # --- commands ---

    def outcome(self, id: int) -> Outcome:
        if id in self.waiting:
            return Outcome.TAKEN
        if id in self.ended:
            return Outcome.DONE if self.ended[id].ok else Outcome.REFUSED
        return Outcome.FORGOTTEN if id <= self._forgotten else Outcome.UNSEEN

    def begin(self, id: int, *, always: bool = False) -> bool:
        """Note a command that was unseen, which `Done` ends. False if too many wait; a command that is done `always` is
        noted nevertheless.
        """
        if len(self.waiting) >= self.bounds.waiting and not always:
            return False
        self.waiting.add(id)
        return True

    # --- the connection ---

    def cut(self, now: float) -> None:
        self.put, self._since = None, now

    def attach(self, put: Callable[[Frame], None], encoding: Encoding) -> None:
        self.put, self.encoding, self._since = put, encoding, None

    def expired(self, now: float) -> bool:
        """Whether the user has been away for too long."""
        return self._since is not None and now - self._since > self.bounds.seconds


NEWEST_WINS = (Sample, Clock, Status)  # what was not sent yet is out of date when the next one comes

BESIDE = 100  # bytes that a frame takes in memory, beside its own


class Outbox:
    """Frames in order, until the socket takes them. `size`: their bytes; a long frame counts as half of `most` at most,
    so that it gets through alone. `overflown`: there were too many, and they were dropped; nothing more is taken.
    """

    def __init__(self, most: int) -> None:
        self.most, self.size, self.overflown = most, 0, False
        self.encoding = Encoding.JSON
        self._waiting: dict[object, tuple[Frame | Struct, int]] = {}  # and what it counts
        self._count = 0

    def put(self, frame: Frame, *, counts: bool = True) -> None:
        """Append a frame; `counts`: its bytes count."""
        if self.overflown:
            return
        self._count += 1
        size = min(len(frame) + BESIDE, self.most // 2) if counts else 0
        self._waiting[self._count] = frame, size
        self.size += size
        if self.size > self.most:
            self.drop()
            self.overflown = True

    def send(self, message: Struct) -> None:
        if isinstance(message, NEWEST_WINS):
            self._waiting.pop(type(message), None)
            self._waiting[type(message)] = message, 0
        else:
            self.put(encode(message, self.encoding))

    def drop(self) -> None:
        self._waiting.clear()
        self.size = 0

    def taken(self, most: float = inf) -> list[Frame]:
        """Take frames for the socket, in order, until they have `most` bytes or more."""
        taken: list[Frame] = []
        while self._waiting and most > 0:
            one, size = self._waiting.pop(next(iter(self._waiting)))
            frame = encode(one, self.encoding) if isinstance(one, Struct) else one
            taken.append(frame)
            self.size -= size
            most -= len(frame)
        return taken
