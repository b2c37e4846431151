"""The message for an error of vrs itself: one line, with the traceback in a file."""

from __future__ import annotations

import tempfile
import traceback
from pathlib import Path

from vrs_cli.values.replies import Message, Tone


def internal_error(error: BaseException, *, afar: bool = False) -> Message:
    """Return the message for an unexpected exception, after which the shell goes on, and write its traceback to a file.
    `afar`: for a user of a served robot; the message gives only the name of the file.
    """
    report = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="vrs-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(report)
        name = Path(file.name).name
        place = f"please tell whoever runs the server: {name}" if afar else f"please report it with {file.name}"
    except OSError:
        place = "please report it"
    return Message(f"internal error: {type(error).__name__}: {error}; {place}", Tone.ERROR)
