"""What of a timeline is not what its robot has said, or was shown wrongly, and the colours of that."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from vrs_cli.interfaces.roles.preview import Previewed

UNCONFIRMED, FLAGGED = (246, 204, 20), (210, 69, 60)  # RGB


class Doubts(NamedTuple):
    """From `unconfirmed` on [s] it is not what the robot has said; something wrong was shown of the times `flagged`;
    `refused`: when commands were issued that the robot will not do [s], and their texts.
    """

    unconfirmed: float = inf
    flagged: tuple[tuple[float, float], ...] = ()
    refused: tuple[tuple[float, str], ...] = ()

    @classmethod
    def of(cls, seen: Previewed | None) -> Doubts:
        if seen is None:
            return NO_DOUBTS
        refused = tuple((one.issued, one.text) for one in seen.expected if one.refused is not None)
        return cls(seen.unconfirmed, seen.flagged, refused)


NO_DOUBTS = Doubts()
