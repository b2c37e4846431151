"""What a server remembers of one user, also while the connection is cut: messages, commands and questions.
Pure: the time of the day is passed in. The log is bounded in bytes, in seconds and in numbers.
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
            case Done(id) if id in self.waiting:
                self.waiting.remove(id)
                self._end(message)
            case Asked(number):
                self.questions[number] = message
            case Withdrawn(number):
                self.questions.pop(number, None)

    def _end(self, done: Done) -> None:
        """Remember how a command has ended, in short."""
        refusal = done.refusal and replace(done.refusal, message=done.refusal.message[:SHORT], detail="", hint="")
        self.ended[done.id] = Done(done.id, done.ok, refusal, done.version)
        if len(self.ended) > self.bounds.ended:
            oldest = next(iter(self.ended))
            del self.ended[oldest]
            self._forgotten = max(self._forgotten, oldest)

    def _trim(self, now: float) -> None:
        told, earliest = self._told, now - self.bounds.seconds
        while told and (told[0][0] < earliest or self._size > self.bounds.told):
            self._size -= len(told.popleft()[1]) + BESIDE

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
