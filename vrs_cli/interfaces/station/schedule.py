"""What was scheduled at one time, to tell later what has moved since."""

from __future__ import annotations

from typing import NamedTuple

from vrs_cli.dialogue.replies import Displaced
from vrs_cli.engine.displacement import displacement
from vrs_cli.engine.engine import Engine
from vrs_cli.trajectory.timeline import Timeline


class Schedule(NamedTuple):
    """A course of events as it was: how it began, and its timeline."""

    initial: Timeline
    timeline: Timeline

    def displaced(self, engine: Engine) -> Displaced | None:
        """What has moved since on the same course; None where nothing has."""
        if self.initial is not engine.initial:
            return None
        changes = engine.deltas[len(engine.deltas) - (engine.timeline.version - self.timeline.version) :]
        found = displacement(self.timeline, engine.timeline, changes, engine.history.done)
        return None if found is None else Displaced(found)
