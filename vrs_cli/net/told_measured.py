"""What a robot's body measures, for clients that look at it: in batches, encoded once for all. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from msgspec import Struct

from vrs_cli.net.body_messages import Measurements
from vrs_cli.values.measured import Report
from vrs_cli.wire.report_rows import columns_of, row_parts

TOLD_EVERY = 0.05  # [s] between two batches
MAX_REMEMBERED = 4000  # reports; a listener that is farther behind is told no older ones


class Batch(Struct, frozen=True):
    """A message with reports; `end`: the number of the first report after them."""

    message: Measurements
    end: int


class MeasuredTeller:
    """Reports in the order in which they came. `count`: how many, since the robot was started."""

    def __init__(self) -> None:
        self.count = 0
        self._fresh: list[Report] = []
        self._batches: deque[Batch] = deque()

    def take(self, reports: Sequence[Report], *, heard: bool) -> bool:
        """Take reports; `heard`: somebody listens. Return whether there is something to tell."""
        self.count += len(reports)
        if heard:
            self._fresh += reports
        return bool(self._fresh)

    def gather(self) -> None:
        """Make batches of the reports that came since the last ones."""
        number = self.count - len(self._fresh)
        for part in row_parts(self._fresh):
            self._batches.append(Batch(Measurements(first=number, **columns_of(part)), number + len(part)))
            number += len(part)
        self._fresh = []
        while self._batches and self._batches[0].end < self.count - MAX_REMEMBERED:
            self._batches.popleft()

    def after(self, number: int) -> list[Batch]:
        """Return the batches with reports from that number on."""
        return [batch for batch in self._batches if batch.end > number]
