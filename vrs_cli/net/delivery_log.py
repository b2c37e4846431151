"""What a server remembers of one holder, also while its connection is cut: what it was told, what it has commanded, and
what it is asked. Pure: the time of the day is passed in. It is bounded in bytes, in seconds and in numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.net.messages import Asked, Done, Numbered, Outcome, Withdrawn
from vrs_cli.net.outbox import BESIDE
from vrs_cli.wire.codec import Encoding, Frame, encode

SHORT = 400  # characters of a refusal that is remembered


class Bounds(Struct, frozen=True):
    """How long a holder is remembered after a cut [s]; bytes of what it was told; commands that have ended, and those
    that have not, and questions with them.
    """

    seconds: float = 60.0
    told: int = 1_000_000
    ended: int = 1000
    waiting: int = 1000


USUAL = Bounds()


class DeliveryLog:
    """`key` resumes the connection of the holder: whoever knows it is taken for the holder. `seq` numbers what it was
    told last. `put`: gives a frame to the connection that is open.
    """

    def __init__(self, key: str, bounds: Bounds = USUAL) -> None:
        self.key, self.bounds = key, bounds
        self.encoding = Encoding.JSON
        self.seq = 0
        self.put: Callable[[Frame], None] | None = None
        self._since: float | None = None  # when its connection was cut
        self._told: deque[tuple[float, Frame]] = deque()  # when, and what: the last of them has the number `seq`
        self._size = 0
        self._waiting: set[int] = set()  # commands that have not ended
        self._ended: dict[int, Done] = {}
        self._forgotten = -1  # the highest id of a command whose end is forgotten
        self._questions: dict[int, Asked] = {}

    # --- what it is told ---

    def tell(self, message: Numbered, now: float) -> None:
        """Over the connection, or when it is resumed."""
        self._note(message)
        self.seq += 1
        frame = encode(replace(message, seq=self.seq), self.encoding)
        self._told.append((now, frame))
        self._size += len(frame) + BESIDE
        self._trim(now if self._since is None else self._since)
        if self.put is not None:
            self.put(frame)

    def _note(self, message: Numbered) -> None:
        match message:
            case Done(id) if id in self._waiting:
                self._waiting.remove(id)
                self._end(message)
            case Asked(number):
                self._questions[number] = message
            case Withdrawn(number):
                self._questions.pop(number, None)

    def _end(self, done: Done) -> None:
        """Remember how a command has ended, in short."""
        refusal = done.refusal and replace(done.refusal, message=done.refusal.message[:SHORT], detail="", hint="")
        self._ended[done.id] = Done(done.id, done.ok, refusal, done.version)
        if len(self._ended) > self.bounds.ended:
            oldest = next(iter(self._ended))
            del self._ended[oldest]
            self._forgotten = max(self._forgotten, oldest)

    def _trim(self, now: float) -> None:
        told, earliest = self._told, now - self.bounds.seconds
        while told and (told[0][0] < earliest or self._size > self.bounds.told):
            self._size -= len(told.popleft()[1]) + BESIDE

    def since(self, seq: int) -> list[Frame] | None:
        """What it was told after that number; None where that is not remembered."""
        missed = self.seq - seq
        if not 0 <= missed <= len(self._told):
            return None
        return [frame for _, frame in list(self._told)[len(self._told) - missed :]]

    # --- what it commands, and what it is asked ---

    def outcome(self, id: int) -> Outcome:
        if id in self._waiting:
            return Outcome.TAKEN
        if id in self._ended:
            return Outcome.DONE if self._ended[id].ok else Outcome.REFUSED
        return Outcome.FORGOTTEN if id <= self._forgotten else Outcome.UNSEEN

    def begin(self, id: int, *, always: bool = False) -> bool:
        """A command that was unseen: whether there is room for it, or it is done `always`. `Done` ends it."""
        if len(self._waiting) >= self.bounds.waiting and not always:
            return False
        self._waiting.add(id)
        return True

    @property
    def waits(self) -> bool:
        """Whether a command has not ended."""
        return bool(self._waiting)

    def done(self, id: int) -> Done | None:
        """How a command has ended."""
        return self._ended.get(id)

    @property
    def questions(self) -> tuple[Asked, ...]:
        """Those that have no answer."""
        return tuple(self._questions.values())

    def asked(self, number: int) -> Asked | None:
        """The question with that number, if it has no answer."""
        return self._questions.get(number)

    # --- its connection ---

    def cut(self, now: float) -> None:
        self.put, self._since = None, now

    def attach(self, put: Callable[[Frame], None], encoding: Encoding) -> None:
        self.put, self.encoding, self._since = put, encoding, None

    def expired(self, now: float) -> bool:
        """Whether the holder has been away for too long."""
        return self._since is not None and now - self._since > self.bounds.seconds
