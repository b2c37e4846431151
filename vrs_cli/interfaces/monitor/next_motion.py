"""What was said for the next motion alone, and not used yet: STATUS shows it."""

from __future__ import annotations

from vrs_cli.engine.engine import Engine
from vrs_cli.language.run.semantics.settings import MODE_WORDS
from vrs_cli.language.words.values import plain


def said_for_next_motion(engine: Engine) -> tuple[str, ...]:
    """Configuration words that the arm does not have yet, and settings for one motion, in the words of the language."""
    settings, have = engine.settings, engine.arm.configuration(engine.destination(engine.end).joints)
    said = list(settings.configuration.words_beside((have,)))
    if (speed := settings.speed.once) is not None:
        said.append(f"SPEED {plain(speed.value)} {speed.unit.value}")
    if settings.duration.once is not None:
        said.append(f"DURATION {plain(settings.duration.once)} s")
    said += (word for word, (mode, on) in MODE_WORDS.items() if settings.modes[mode].once is on)
    if settings.hand is not None:
        said.append("OPEN" if settings.hand else "CLOSE")
    return tuple(said)
