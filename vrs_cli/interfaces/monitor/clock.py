"""CLOCK: show the clock that the robot follows; pause a clock of real time, let it go on, change its rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE, WallClock
from vrs_cli.errors import IllegalValue, UsageError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.text.ast import BareWord, Instruction
from vrs_cli.language.words.values import read_number
from vrs_cli.values.replies import ClockReport

RATES = f"CLOCK RATE = {SLOWEST_RATE:g} to {FASTEST_RATE:g}"


def clock(station: Station, it: Instruction) -> Dialogue[None]:
    """CLOCK, CLOCK PAUSE, CLOCK GO, CLOCK RATE = r. Raises UsageError, IllegalValue."""
    if it.arguments:
        word, time = it.arguments[0], station.engine.clock
        assert isinstance(word, BareWord)
        if not isinstance(time, WallClock):
            raise UsageError("time is the robot's own here, and passes only when something waits", "vrs --realtime")
        _change(time, word.text.upper(), it.value)
        station.settle()  # it has gone on since the line was given, and may stand now
    yield clock_report(station)


def clock_report(station: Station) -> ClockReport:
    """Tell the present clock."""
    time = station.engine.clock
    return ClockReport(time.now, time.rate if isinstance(time, WallClock) else None, time.paused)


def _change(time: WallClock, word: str, value: object) -> None:
    if word == "RATE":
        time.change(rate=_rate(value))
        return
    change = CHANGES.get(word)
    if change is None or value is not None:
        raise UsageError(f"CLOCK {word}", f"CLOCK PAUSE, CLOCK GO, {RATES}")
    change(time)


def _rate(value: object) -> float:
    rate = read_number(value.text) if isinstance(value, BareWord) else None
    if rate is None or not SLOWEST_RATE <= rate <= FASTEST_RATE:
        shown = value.text if isinstance(value, BareWord) else "nothing"
        raise IllegalValue(f"a rate of {shown}", RATES)
    return rate


CHANGES: Mapping[str, Callable[[WallClock], None]] = {
    "PAUSE": lambda time: time.change(paused=True),
    "GO": lambda time: time.change(paused=False),
}
CLOCK_WORDS: Mapping[str, str] = {
    "PAUSE": "time stands, and with it the arm",
    "GO": "time goes on",
    "RATE": "RATE = r: so many seconds of the robot in one second",
}
