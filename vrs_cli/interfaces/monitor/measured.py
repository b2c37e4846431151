"""WHERE MEASURED: where a body measured the robot, and how far that is from the timeline."""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.engine.comparison import measured_position, why_unknown
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside
from vrs_cli.interfaces.station.operands import NO_REPORT, moment, operand, times
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.ast import Instruction
from vrs_cli.values.measured import MeasuredPosition
from vrs_cli.values.numbers import count
from vrs_cli.values.replies import MeasuredWhereabouts, Message, WhereaboutsTable


def where_measured(station: Station, it: Instruction) -> Dialogue[None]:
    """WHERE MEASURED: the last report, a time, or a stretch of time."""
    measured = station.engine.measured.view
    if measured.end is None:
        raise UsageError(*NO_REPORT)
    arm, timeline, units = station.engine.arm, station.engine.timeline, station.units
    if not any(operand(it, index) is not None for index in (1, 2, 3)):
        t = moment(station, it) if it.modifiers.timed else measured.end
        at = measured_position(arm, timeline, measured, t)
        yield Message(why_unknown(measured, t)) if at is None else MeasuredWhereabouts(at, t == measured.end, units)
        return
    if it.modifiers.timed:
        what = "WHERE MEASURED AT t, or WHERE MEASURED FROM t1 TO t2 STEP dt"
        raise UsageError("AT and FROM do not go together", what)
    instants = tuple(times(station, it))

    def looks() -> Iterator[MeasuredPosition | None]:
        return (measured_position(arm, timeline, measured, t) for t in instants)

    rows = yield from beside(lambda: tuple(at.measured for at in looks() if at is not None))
    yield WhereaboutsTable(rows, units)
    if len(rows) < len(instants):
        yield Message(f"The measured robot is unknown at {count(len(instants) - len(rows), 'other time')}")
