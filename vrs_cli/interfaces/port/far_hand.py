"""The arm of JOG, moved by requests over a port."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.values.hand import Look, Press, Seen, StopJog
from vrs_cli.wire.messages import At, Done, Refused, Request, ServerMessage

Begin = Callable[[Callable[[int], Request], Callable[[ServerMessage], None]], object]


class FarHand:
    """Sends the steps of keys that are held down as fast as the arm answers, and no faster: after a key is let go, no
    earlier step follows. `begin`: that of a port; `seen`: the arm before the first step.
    """

    def __init__(self, begin: Begin, joints: int, units: JointUnits, seen: Seen) -> None:
        self.joints, self.units = joints, units
        self._begin, self._seen = begin, seen
        self._on_way: list[Press | StopJog | Look] = []

    def do(self, act: Press | StopJog | Look) -> Seen:
        """Send what a key says; return what was seen last."""
        if act not in self._on_way:
            self._send(act)
        return self._seen

    def _send(self, act: Press | StopJog | Look) -> None:
        def hear(end: ServerMessage) -> None:
            with suppress(ValueError):  # a brake, or what was forgotten
                self._on_way.remove(act)
            if isinstance(end, Done) and isinstance(end.found, Seen):
                self._seen = end.found
            elif isinstance(end, Done | Refused) and end.refusal is not None:
                self._say(end.refusal.error())

        if not isinstance(act, StopJog):
            self._on_way.append(act)
        try:
            self._begin(lambda id: At(id, act), hear)
        except RequestRefused as error:
            self._on_way.clear()
            self._say(error)

    def _say(self, error: VrsError) -> None:
        seen = self._seen
        self._seen = Seen(seen.position, seen.end, seen.paused, str(error))
