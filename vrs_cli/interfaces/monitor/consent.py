"""What is asked before something is lost: a program, a variable, a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from vrs_cli.dialogue.questions import Confirmation, Parting
from vrs_cli.dialogue.replies import Farewell, Message, Reply, Tone
from vrs_cli.dialogue.terminal import Dialogue
from vrs_cli.errors import FileError, FileExists
from vrs_cli.interfaces.station.station import Station
from vrs_cli.language.words.kind import Kind, key_of


def refusal(station: Station, question: str) -> Message | None:
    """None where the user agrees, or has said DISABLE INTERACTIVE; otherwise what is said of it."""
    if not station.robot.switch("INTERACTIVE"):
        return None
    if station.terminal.confirm(Confirmation(f"{question} Are you sure (Y/N)?")):
        return None
    if isinstance(station.terminal, Dialogue):
        return Message("Nothing is deleted")
    return Message("*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)", Tone.ERROR)


def leave(station: Station) -> Iterator[Reply]:
    """EXIT: Farewell, once the user knows what is not stored. Where nobody is there, at once."""
    terminal, named = station.terminal, "; ".join(_not_stored(station))
    if named and isinstance(terminal, Dialogue) and station.robot.switch("INTERACTIVE"):
        yield Message(f"Not stored: {named}. STORE file stores all", Tone.WARNING)
        if not terminal.leave(Parting("Leave without storing (Y/N)?")):
            return
    yield Farewell()


def _not_stored(station: Station) -> Iterator[str]:
    """Programs and variables that no file has."""
    unstored = station.unstored
    if programs := unstored.programs():
        yield listed("program", programs)
    for what, kinds in (("location", PLACES), ("real", (Kind.REAL,)), ("string", (Kind.STRING,))):
        if names := sorted(map(station.environment.name_of, unstored.items(*kinds))):
            yield listed(what, names)


MOST_NAMED = 10
PLACES = (Kind.LOCATION, Kind.PRECISION)


def listed(what: str, names: list[str]) -> str:
    """`program pick`, `locations a, b`, the first few of many."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{what}{'s' if len(names) > 1 else ''} {', '.join(names[:MOST_NAMED])}{more}"


def may_replace(station: Station, program: str) -> bool:
    """Whether a program of that name may be put in memory: none is there, or the user lets it go."""
    if key_of(program) in station.programs and station.robot.switch("INTERACTIVE"):
        return station.terminal.confirm(Confirmation(f"Program {program} exists. Replace it (Y/N)?"))
    return True


def may_write(station: Station, path: Path) -> None:
    """Raises FileExists where the user does not want a file overwritten, or nobody can be asked, FileError for the
    journal of this session."""
    journal = station.journal
    if journal is not None and path.exists() and journal.exists() and path.samefile(journal):
        raise FileError(f"{path} holds all of this session already, and is being written", "name another file")
    if path.exists() and station.robot.switch("INTERACTIVE"):  # noqa: SIM102
        if not station.terminal.confirm(Confirmation(f"{path} exists. Overwrite it (Y/N)?")):
            raise FileExists(str(path), "answer Y or name another file; DISABLE INTERACTIVE overwrites")
