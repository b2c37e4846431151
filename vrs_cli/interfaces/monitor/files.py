"""Commands on files: load and store programs and variables, save trajectories, and change the folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path

from msgspec import structs

from vrs_cli.engine.position import position_at
from vrs_cli.errors import FileError, ProgramExists, UsageError
from vrs_cli.files import store as files
from vrs_cli.files.atomic import write_atomically
from vrs_cli.files.folder import copy, delete, entries, existing, rename, target
from vrs_cli.files.journal import bookmark_of
from vrs_cli.files.opening import Folder
from vrs_cli.files.program_file import find_program_file, project_of, read_program_file
from vrs_cli.files.store import MemoryPart
from vrs_cli.files.trajectory_file import EXTENSION, Recording, read_trajectory, write_trajectory
from vrs_cli.interfaces.dialogue import Dialogue, Reading, beside
from vrs_cli.interfaces.monitor.timeline import check_tasks_stand
from vrs_cli.interfaces.station.operands import (
    PLACES,
    Handler,
    agreed,
    confirmed,
    listed,
    may_replace,
    may_write,
    operand,
    path_of,
    word,
)
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.ast import Instruction, Program, Section
from vrs_cli.trajectory.segment import Segment
from vrs_cli.values.numbers import Value, count, seconds
from vrs_cli.values.questions import Playing
from vrs_cli.values.replies import FileTable, FileText, Message, ReplayRow, ReplayTable, Tone, report

TORN = "its last line was not written to the end, and was left out"


def load(station: Station, named: Path) -> Dialogue[None]:
    """Load a file. Programs that are in memory are replaced where the user agrees, else they stay as they are;
    variables are overwritten. Where no program was run yet, EXECUTE alone runs the first program of the file.

    A sample program of vrs is found by its name from every folder. Files that a comment in the file names (`; with:
    lib.v2`) are loaded before it. Raises NonexistentFile, FileOutside, FileError, FileDamaged.
    """
    path, folder = find_program_file(named, station.folder), station.folder
    if path.suffix.lower() == EXTENSION:
        yield from _load_trajectory(station, path)
        return
    text = yield from beside(lambda: read_program_file(path, folder))
    files = yield from beside(lambda: project_of(path, text, closed=folder.closed))
    last = station.last_program
    for file, its in reversed(files.items()):
        station.last_program = last
        yield from _load_text(station, file, its)


def _load_text(station: Station, path: Path, text: str) -> Dialogue[None]:
    ready = yield from station.loaded(text, path.stem)
    values = yield from beside(ready.variables.values)
    kept = yield from _kept(station, values)
    programs = station.programs
    before, layout = dict(programs), station.layout
    station.take(ready)
    station.unstored.values_loaded(values)
    for item, value in kept.items():
        station.environment.put_back(item, value)
    if ready.diagnostics:
        yield report(ready.diagnostics, text, str(path))
    loaded = [stored for key, stored in programs.items() if before.get(key) is not stored]
    old: list[StoredProgram] = []
    for stored in loaded:
        if stored.program.key not in before:
            continue
        replaced = yield from may_replace(station, stored.name)
        if replaced:
            continue
        old.append(stored)
        programs[stored.program.key] = before[stored.program.key]
        station.layout = station.layout.with_part(stored.program.key, layout.parts.get(stored.program.key, ()))
        if replaced is None:
            hint = "DELETEP deletes it, DISABLE INTERACTIVE lets it be replaced"
            yield Message(str(ProgramExists(stored.name, hint)), Tone.ERROR)
    new = [stored for stored in loaded if stored not in old]
    station.unstored.programs_stored(stored.program for stored in new)
    if station.last_program is None and new:
        station.last_program = new[0].name
    names = [_loaded(stored, replaced=stored.program.key in before) for stored in new]
    stay = (
        f"; {', '.join(stored.name for stored in old)} {'stays' if len(old) == 1 else 'stay'} as before" if old else ""
    )
    if ready.diagnostics and not loaded and not values:
        yield Message(f"nothing of {path} is loaded", Tone.ERROR)
        return
    yield Message(f"{path} loaded" + (f": {', '.join(names)}" if names else "") + stay)


def _kept(station: Station, values: Mapping[Item, Value]) -> Dialogue[dict[Item, Value]]:
    """The values of locations that are not stored, and that the user does not want a file to overwrite. Where no user
    can be asked, a file overwrites them, as it does all variables.
    """
    environment = station.environment
    if not station.user_state.attended:
        return {}
    lost = [item for item in station.unstored.items(*PLACES) if item in values]
    are = "is" if len(lost) == 1 else "are"
    names = listed("location", sorted(map(environment.name_of, lost)))
    if not lost or (yield from confirmed(station, f"The {names} {are} not stored. Overwrite (Y/N)?")):
        return {}
    return {item: value for item in lost if (value := environment.value(item)) is not None}


def _load_trajectory(station: Station, path: Path) -> Dialogue[None]:
    """Make a branch of a trajectory file: it can be continued, compared, and merged into main."""
    branches = station.branches
    name = re.sub(r"\W", ".", path.stem)
    name = name if name[0].isalpha() else f"t{name}"
    if name in branches:
        raise UsageError(f"there is a branch {name} already", f"DELETEB {name}, then LOAD again; or rename the file")
    check_tasks_stand(station)
    recording = yield from _recording(station, path)
    left = yield from beside(lambda: bookmark_of(path, recording, station.engine))
    check_tasks_stand(station)
    branches.add(name, left)
    branches.change_over(name)
    if recording.dropped_tail:
        yield Message(TORN, Tone.WARNING)
    yield from (Message(warning, Tone.WARNING) for warning in recording.warnings)
    if recording.measured:
        yield Message(f"{path} has {count(len(recording.measured), 'measured report')}, which stay in the file")
    commands = count(station.engine.book.history.commands, "command")
    yield Message(f"On {name}, a branch of {commands} from {path}; the clock is at {station.engine.now:.3f} s")


def _recording(station: Station, path: Path) -> Dialogue[Recording]:
    """Read a trajectory file, and show the progress at the terminal."""
    terminal, folder = station.terminal, station.folder
    return (
        yield from beside(
            lambda: read_trajectory(path, lambda share: terminal.progress(Reading(str(path), share)), within=folder)
        )
    )


def _loaded(stored: StoredProgram, *, replaced: bool) -> str:
    marks = ["replaced"] * replaced + ["not executable"] * (not stored.analysis.executable)
    return f"{stored.name} ({', '.join(marks)})" if marks else stored.name


def _store(extension: str, *parts: str) -> Handler:
    """Return the handler that stores these parts of memory (names of `MemoryPart`)."""

    def store(station: Station, it: Instruction) -> Dialogue[None]:
        path = _with_extension(path_of(station, it), extension)
        what: list[MemoryPart] = [files.MemoryPart[name] for name in parts]
        programs = [word(argument) for argument in it.arguments[1:]]
        memory, layout = station.environment.copy(), station.layout
        everything = not programs and set(what) >= files.EVERYTHING

        def written() -> tuple[str, Sequence[Program | Section], Mapping[Item, Value]]:
            chosen = files.chosen(memory, what, programs)
            return files.text_of(chosen, layout, everything=everything), chosen, files.values_of(memory, chosen)

        text, chosen, values = yield from beside(written)
        if not text.strip():
            yield Message("There is nothing to store", Tone.WARNING)
            return
        yield from may_write(station, path)
        write_atomically(path, text, station.folder)
        station.unstored.programs_stored(part for part in chosen if isinstance(part, Program))
        station.unstored.values_stored(values)
        yield Message(f"{path} stored")

    return store


def _with_extension(path: Path, extension: str) -> Path:
    return path if path.suffix else path.with_name(path.name + extension)


def _save(station: Station, it: Instruction) -> Dialogue[None]:
    engine = station.engine
    path = _with_extension(path_of(station, it), EXTENSION)
    yield from may_write(station, path)
    model, initial, deltas = engine.model, engine.book.initial, engine.book.deltas.copy()
    measured = engine.measured.view
    yield from beside(lambda: write_trajectory(path, model, initial, deltas, station.folder, measured))
    yield Message(f"{path} saved: {count(engine.book.history.commands, 'command')}, {engine.end:.3f} s")


def _replay(station: Station, it: Instruction) -> Dialogue[None]:
    path = path_of(station, it)
    path = path if path.exists() else _with_extension(path, EXTENSION)
    recording = yield from _recording(station, path)
    yield from (Message(warning, Tone.WARNING) for warning in recording.warnings)
    timeline, title = recording.timeline, recording.model.title
    changes, segments = count(len(recording.deltas), "change"), count(len(timeline), "segment")
    yield Message(f"{path}: {title}, {changes}, {segments}, {seconds(timeline.start)} to {seconds(timeline.end)}")
    named = os.path.relpath(path, station.folder.root)
    shown = station.user_state.attended and (yield from station.user_state.show(recording, Playing(named)))
    if recording.dropped_tail and not shown:
        yield Message(TORN, Tone.WARNING)
    arm, there = recording.arm, [recording]
    del recording, timeline  # their memory is given back beside
    rows = yield from beside(lambda: _replayed(arm, there.pop()))
    if not shown:
        yield ReplayTable(rows)


def _replayed(arm: RobotArm, recording: Recording) -> tuple[ReplayRow, ...]:
    """The rows of a recording that nothing else refers to. Its memory is freed in small parts: a million values that
    are freed at once hold every thread.
    """
    timeline, deltas = recording.timeline, list(recording.deltas)
    del recording
    segments = list(timeline)
    last = _last_of_motions(segments)
    ends = ((it.motion, it.finish) for it in last)
    rows = tuple(ReplayRow(it.number, it.text, t, position_at(arm, timeline, t).T_world_tool) for it, t in ends)
    del timeline
    while deltas:
        deltas.pop()
    while segments:
        segments.pop()
    return rows


def _last_of_motions(segments: Sequence[Segment]) -> Iterator[Segment]:
    """The initial segment, and the last one of each motion."""
    for segment, follower in zip_longest(segments, segments[1:]):
        if follower is None or follower.motion.number != segment.motion.number:
            yield segment


def _flist(station: Station, it: Instruction) -> Dialogue[None]:
    path, folder = path_of(station, it), station.folder
    yield FileText((yield from beside(lambda: tuple(read_program_file(path, folder).splitlines()))))


def _fdirectory(station: Station, it: Instruction) -> Dialogue[None]:
    given, folder = operand(it, 0), station.folder
    asked = folder.root if given is None else folder.path(word(given), pattern=True)
    yield FileTable(str(asked), entries(asked, folder))


def _cd(station: Station, it: Instruction) -> Dialogue[None]:
    """Raises FileError for what is no folder, FileOutside for one out of a closed one."""
    asked, home = operand(it, 0), station.home
    if asked is None:
        station.change_folder(home)
    else:
        name, present = word(asked), station.folder.root
        if not home.closed:
            path = station.folder.path(name)
        elif name.strip() == "..":  # not above the closed folder
            path = present if present == home.root else present.parent
        else:
            path = home.root if name.strip() == "/" else station.folder.inside(name)
        if not path.is_dir():
            raise FileError(f"{name} is no folder", "FDIRECTORY lists what there is")
        station.change_folder(structs.replace(home, root=Path(os.path.normpath(path))))
    yield from _pwd(station, it)


def _pwd(station: Station, _it: Instruction) -> Dialogue[None]:
    """Tell the present folder; the place of a closed folder only where it is disclosed."""
    root, home = station.folder.root, station.home
    hidden = home.closed and not home.disclosed
    yield Message(f"/{root.relative_to(home.root).as_posix().strip('.')}" if hidden else os.path.abspath(root))


def _log(station: Station, it: Instruction) -> Dialogue[None]:
    """Begin or end writing the session to a file. Raises UsageError where this robot cannot, FileError."""
    asked, log = operand(it, 0), station.log
    path = None if asked is None else station.folder.path(word(asked))
    if log is None:
        raise UsageError("LOG writes no file at this robot", "LOG is for a shell at its own robot")
    if path is not None:
        yield from may_write(station, path)
        log(path)
        yield Message(f"{path} takes down what is typed and answered; LOG alone ends it")
    elif (done := log(None)) is None:
        raise UsageError("no LOG is written", "LOG session.txt begins one; .html and .cast are other forms")
    else:
        yield Message(f"{done} is complete")


def _fdelete(station: Station, it: Instruction) -> Dialogue[None]:
    path = existing(path_of(station, it))
    if not (yield from agreed(station, f"The file {path} will be deleted.")):
        return
    delete(path, station.folder)
    yield Message(f"{path} deleted")


def _to_another(act: Callable[[Path, Path, Folder], None], done: str) -> Handler:
    """FCOPY and FRENAME of `new = old`. Raise FileError and what is under it."""

    def put(station: Station, it: Instruction) -> Dialogue[None]:
        old = existing(station.folder.path(word(it.value)))
        new = target(old, path_of(station, it))
        yield from may_write(station, new)
        act(old, new, station.folder)
        yield Message(f"{old} {done} {new}")

    return put


FILES: Mapping[str, Handler] = {
    **dict.fromkeys(("LOAD", "LOADP", "LOADL"), lambda station, it: load(station, path_of(station, it))),
    "STORE": _store(".v2", "PROGRAMS", "LOCATIONS", "REALS", "STRINGS"),
    "STOREP": _store(".pg", "PROGRAMS"),
    "STOREL": _store(".lc", "LOCATIONS"),
    "STORER": _store(".rv", "REALS"),
    "STORES": _store(".st", "STRINGS"),
    "SAVE": _save,
    "REPLAY": _replay,
    "FLIST": _flist,
    "FDIRECTORY": _fdirectory,
    "LISTF": _fdirectory,
    "CD": _cd,
    "PWD": _pwd,
    "LOG": _log,
    "FDELETE": _fdelete,
    "FCOPY": _to_another(copy, "copied to"),
    "FRENAME": _to_another(rename, "renamed to"),
}
