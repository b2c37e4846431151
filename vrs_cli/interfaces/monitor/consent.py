"""Questions before something is lost: a program, a variable, a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.errors import FileError, FileExists
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.language.words.values import Kind, key_of
from vrs_cli.values.questions import Confirmation, Parting
from vrs_cli.values.replies import Farewell, Message, Tone

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station


def agreed(station: Station, question: str) -> Dialogue[bool]:
    """Ask whether something may be deleted; yes after DISABLE INTERACTIVE. Where it may not, the user is told."""
    answer = yield from confirmed(station, f"{question} Are you sure (Y/N)?")
    if answer is False:
        yield Message("Nothing is deleted")
    elif answer is None:
        what = "*Not confirmed* nothing is deleted (DISABLE INTERACTIVE deletes without a question)"
        yield Message(what, Tone.ERROR)
    return bool(answer)


def confirmed(station: Station, question: str) -> Dialogue[bool | None]:
    """Ask, and return the answer, None where there is none. After DISABLE INTERACTIVE yes, without a question."""
    if not station.engine.settings.switch("INTERACTIVE"):
        return True
    answer = yield Confirmation(question)
    return None if answer is None else bool(answer)


def leave(station: Station) -> Dialogue[None]:
    """EXIT: say Farewell, once the user knows what is not stored; at once where no person is there, or where the robot
    goes on for other users, with all that it has in memory.
    """
    if (
        station.user_state.attended
        and station.user_state is station.own_user_state
        and station.engine.settings.switch("INTERACTIVE")
    ):
        unstored, name_of = station.unstored, station.environment.name_of
        rows = [("program", unstored.programs())]
        for what, kinds in (("location", PLACES), ("real", (Kind.REAL,)), ("string", (Kind.STRING,))):
            rows.append((what, sorted(map(name_of, unstored.items(*kinds)))))
        named = "; ".join(listed(what, names) for what, names in rows if names and unstored.asked_about)
        told = [f"{station.task.program} is running"] if station.task is not None and station.running else []
        told += [f"Not stored: {named}. STORE file stores all"] if named else []
        leaves = "Leave without storing (Y/N)?" if named else "Leave (Y/N)?"
        if told and not (yield Parting(leaves, "\n".join(told))):
            return
    yield Farewell()


MOST_NAMED = 10
PLACES = (Kind.LOCATION, Kind.PRECISION)


def listed(what: str, names: list[str]) -> str:
    """`program pick`, `locations a, b`, the first few of many."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{what}{'s' if len(names) > 1 else ''} {', '.join(names[:MOST_NAMED])}{more}"


def may_replace(station: Station, program: str) -> Dialogue[bool | None]:
    """Return whether a program of that name may be put in memory: there is none, or the user agrees. None where nobody
    answers.
    """
    if key_of(program) not in station.programs:
        return True
    return (yield from confirmed(station, f"Program {program} exists. Replace it (Y/N)?"))


def may_write(station: Station, path: Path) -> Dialogue[None]:
    """Ask before a file is overwritten. Raises FileExists where the user does not agree or nobody answers, FileError
    for the journal of this session.
    """
    journal = station.journal
    if journal is not None and path.exists() and journal.exists() and path.samefile(journal):
        raise FileError(f"{path} holds all of this session already, and is being written", "name another file")
    if path.exists() and not (yield from confirmed(station, f"{path} exists. Overwrite it (Y/N)?")):
        raise FileExists(str(path), "answer Y or name another file; DISABLE INTERACTIVE overwrites")
