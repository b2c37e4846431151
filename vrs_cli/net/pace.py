"""Whether a robot waits for a holder that has not taken what a program TYPEs: in virtual time a program types as fast
as it computes. Pure: the time of the day is passed in.
"""

from __future__ import annotations

from math import inf

MUCH, LITTLE = 256 * 1024, 64 * 1024  # bytes: who is so far behind is waited for, until it is no further than that
LUMP = 32 * 1024  # bytes that it takes meanwhile
PATIENCE = (
    5.0  # [s] in which it takes a LUMP, or is waited for no longer: TCP gives a slow reader hundreds of KB at once
)


class SendPace:
    """`waiting`: bytes that wait for its socket, as the thread of the connections sees them. Who does not take a LUMP
    in PATIENCE is not waited for again before it has caught up.
    """

    def __init__(self) -> None:
        self.waiting = 0
        self._least, self._until = inf, 0.0  # bytes, and when it is to have taken one more LUMP; while it is waited for
        self._stuck = False

    def lags(self, now: float) -> bool:
        """Whether it is to be waited for. In the robot's thread."""
        waiting, waited = self.waiting, self._least < inf
        if waiting <= (LITTLE if waited or self._stuck else MUCH):
            self._least, self._stuck = inf, False
        elif not self._stuck:
            if waiting <= self._least - LUMP:
                self._least, self._until = waiting, now + PATIENCE
            elif now > self._until:
                self._least, self._stuck = inf, True
        return self._least < inf
