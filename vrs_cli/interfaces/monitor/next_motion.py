"""What was said for the next motion alone, and not used yet: STATUS shows it."""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.language.run.semantics.settings import MODE_WORDS
from vrs_cli.language.words.values import plain


def said_for_next_motion(engine: Engine) -> tuple[str, ...]:
    """Configuration words that the arm does not have yet, and settings for one motion, in the words of the language."""
    have = engine.arm.configuration(engine.destination(engine.end).joints)
    return (*engine.settings.configuration.words_beside((have,)), *_settings_once(engine.settings))


def _settings_once(settings: Settings) -> Iterator[str]:
    speed = settings.speed.once
    if speed is not None:
        yield f"SPEED {plain(speed.value)} {speed.unit.value}"
    if settings.duration.once is not None:
        yield f"DURATION {plain(settings.duration.once)} s"
    yield from (word for word, (mode, on) in MODE_WORDS.items() if settings.modes[mode].once is on)
    if settings.hand is not None:
        yield "OPEN" if settings.hand else "CLOSE"
