"""The line at the bottom of the shell: clock, speeds, where the tool is, and what was said last."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vrs_cli.engine.clock import WallClock

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine
    from vrs_cli.interfaces.session.session import Session

GAP = " | "
LEAST_MESSAGE = 12  # columns: a shorter rest of the line says nothing


def toolbar(session: Session | None, last: str, width: int) -> str:
    """As much of it as fits, the most useful first. Without a session yet: that it is being made ready."""
    if session is None:
        return " one moment: the robot is being made ready"[:width]
    text = ""
    for part in filter(None, _state(session)):
        longer = f"{text}{GAP}{part}" if text else f" {part}"
        if len(longer) <= width:
            text = longer
    return text + _message(last, width - len(text))


def _message(last: str, room: int) -> str:
    """The message, cut where it is too long; nothing where hardly any of it would be seen."""
    from vrs_cli.render.blocks import shortened

    room -= len(GAP)
    if not last or room < min(len(last), LEAST_MESSAGE):
        return ""
    return GAP + shortened(last, room)


def _pace(engine: Engine) -> tuple[str, ...]:
    """In real time: the rate where it is not 1, and what the arm does."""
    clock = engine.clock
    if not isinstance(clock, WallClock):
        return ()
    doing = f"moves until {engine.end:.1f} s" if engine.now < engine.end else "at rest"
    pace = "paused" if clock.paused else "" if clock.rate == 1.0 else f"rate {clock.rate:g}"
    return (f"{pace}, {doing}" if pace else doing,)


def _state(session: Session) -> tuple[str, ...]:
    from vrs_cli.dialogue.numbers import fixed
    from vrs_cli.language.words.values import numbers_of

    engine = session.engine
    position = engine.position()
    x, y, z, *_ = (fixed(number, 1) for number in numbers_of(position.T_world_tool))
    speed = engine.settings.speed.always
    return (
        f"t {fixed(engine.now, 2)} s",
        *_pace(engine),
        f"X {x} Y {y} Z {z}",
        f"{fixed(engine.settings.monitor_speed, 0)} % / {fixed(speed.value, 0)} {speed.unit.value}",
        str(engine.arm.configuration(position.joints)),
    )
