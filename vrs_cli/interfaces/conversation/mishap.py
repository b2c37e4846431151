"""What is said when the shell itself is at fault: one line, with the traceback in a file."""

from __future__ import annotations

import tempfile
import traceback

from vrs_cli.dialogue.replies import Message, Tone


def internal_error(error: BaseException) -> Message:
    """The message for an exception that should not have been. The shell goes on after it."""
    report = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="vrs-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(report)
        place = f"please report it with {file.name}"
    except OSError:
        place = "please report it"
    return Message(f"internal error: {type(error).__name__}: {error}; {place}", Tone.ERROR)
