"""Commands on files: load and store programs and variables, save trajectories, and change the folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path

from msgspec import structs

from vrs_cli.engine.position import position_at
from vrs_cli.errors import FileError, ProgramExists, UsageError
from vrs_cli.files import atomic, disk, journal, opening, program_file, store, trajectory_file
from vrs_cli.interfaces.dialogue import Dialogue, Reading, beside
from vrs_cli.interfaces.monitor.timeline import check_tasks_stand
from vrs_cli.interfaces.station import operands
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.run.memory import StoredProgram
from vrs_cli.language.run.variables import Item
from vrs_cli.language.text.ast import Instruction, Program, Section
from vrs_cli.values import numbers, questions, replies, results

TORN = "its last line was not written to the end, and was left out"


@operands.handles("LOAD", "LOADP", "LOADL")
def _load(station: Station, it: Instruction) -> Dialogue[None]:
    return load(station, operands.path_of(station, it))


def load(station: Station, named: Path) -> Dialogue[None]:
    """Load a program file, or a trajectory as a new branch. If programs of the same name exist, the user is asked;
    other programs are kept. Variables are overwritten. If no program has run yet, the first program of the file becomes
    the one that EXECUTE without a name runs. Sample programs of vrs are found by name from any folder. Files named in a
    comment of the file (`; with: lib.v2`) are loaded first. Raises NonexistentFile, FileOutside, FileError,
    FileDamaged."""
    path, folder = Path(program_file.find_program_file(named, station.folder)), station.folder
    if path.suffix.lower() == trajectory_file.EXTENSION:
        yield from _load_trajectory(station, path)
        return
    text = yield from beside(lambda: program_file.read_program_file(path, folder))
    project = yield from beside(lambda: program_file.project_of(str(path), text, closed=folder.closed))
    last = station.last_program
    for file, file_text in reversed(project.items()):
        station.last_program = last
        yield from _load_text(station, Path(file), file_text)


def _load_text(station: Station, path: Path, text: str) -> Dialogue[None]:
    """Load the text of one program file. Report what was loaded, replaced and kept."""
    ready = yield from station.read_file(text, path.stem)
    values = yield from beside(ready.variables.values)
    kept = yield from _values_to_keep(station, values)
    programs = station.programs
    before, layout = dict(programs), station.layout
    station.take(ready)
    station.unstored.values_loaded(values)
    for item, value in kept.items():
        station.environment.put_back(item, value)
    if ready.diagnostics:
        yield replies.report(ready.diagnostics, text, str(path))
    loaded = [stored for key, stored in programs.items() if before.get(key) is not stored]
    old: list[StoredProgram] = []
    for stored in (one for one in loaded if one.program.key in before):
        replaced = yield from operands.may_replace(station, stored.name)
        if replaced:
            continue
        old.append(stored)
        programs[stored.program.key] = before[stored.program.key]
        station.layout = station.layout.with_part(stored.program.key, layout.parts.get(stored.program.key, ()))
        if replaced is None:
            refusal = ProgramExists(stored.name, "DELETEP deletes it, DISABLE INTERACTIVE lets it be replaced")
            yield results.Message(str(refusal), results.Tone.ERROR)
    new = [stored for stored in loaded if stored not in old]
    station.unstored.programs_stored(stored.program for stored in new)
    if station.last_program is None and new:
        station.last_program = new[0].name
    if ready.diagnostics and not loaded and not values:
        yield results.Message(f"nothing of {path} is loaded", results.Tone.ERROR)
        return
    marks = {
        one.name: ["replaced"] * (one.program.key in before) + ["not executable"] * (not one.analysis.executable)
        for one in new
    }
    names = [f"{name} ({', '.join(marked)})" if marked else name for name, marked in marks.items()]
    stay = f"; {', '.join(one.name for one in old)} {'stays' if len(old) == 1 else 'stay'} as before" if old else ""
    yield results.Message(f"{path} loaded" + (f": {', '.join(names)}" if names else "") + stay)


def _values_to_keep(station: Station, values: Mapping[Item, numbers.Value]) -> Dialogue[dict[Item, numbers.Value]]:
    """Return the locations, with their values, that the file would overwrite but the user wants to keep because they
    are in no file. If no person is present to be asked, return none."""
    environment = station.environment
    if not station.user_state.attended:
        return {}
    lost = [item for item in station.unstored.items(*operands.PLACES) if item in values]
    are = "is" if len(lost) == 1 else "are"
    names = operands.name_some("location", sorted(map(environment.name_of, lost)))
    if not lost or (yield from operands.ask_yes_no(station, f"The {names} {are} not stored. Overwrite (Y/N)?")):
        return {}
    return {item: value for item in lost if (value := environment.value(item)) is not None}


def _load_trajectory(station: Station, path: Path) -> Dialogue[None]:
    """Make a branch from a trajectory file, and switch to it. The branch can be continued, compared, and merged into
    main."""
    branches = station.branches
    name = re.sub(r"\W", ".", path.stem)
    name = name if name[0].isalpha() else f"t{name}"
    if name in branches:
        raise UsageError(f"there is a branch {name} already", f"DELETEB {name}, then LOAD again; or rename the file")
    check_tasks_stand(station)
    recording = yield from _read_recording(station, path)
    left = yield from beside(lambda: journal.bookmark_of(path, recording, station.engine))
    check_tasks_stand(station)
    branches.add(name, left)
    branches.change_over(name)
    if recording.dropped_tail:
        yield results.Message(TORN, results.Tone.WARNING)
    yield from (results.Message(warning, results.Tone.WARNING) for warning in recording.warnings)
    if recording.measured:
        yield results.Message(
            f"{path} has {numbers.count(len(recording.measured), 'measured report')}, which stay in the file"
        )
    commands = numbers.count(station.engine.book.history.commands, "command")
    yield results.Message(f"On {name}, a branch of {commands} from {path}; the clock is at {station.engine.now:.3f} s")


def _read_recording(station: Station, path: Path) -> Dialogue[trajectory_file.Recording]:
    """Read a trajectory file. The terminal shows the progress."""
    terminal, folder = station.terminal, station.folder
    return beside(
        lambda: trajectory_file.read_trajectory(
            path, lambda share: terminal.progress(Reading(str(path), share)), within=folder
        )
    )


@operands.handles("STORE", extension=".v2", parts=store.EVERYTHING)
@operands.handles("STOREP", extension=".pg", parts={store.MemoryPart.PROGRAMS})
@operands.handles("STOREL", extension=".lc", parts={store.MemoryPart.LOCATIONS})
@operands.handles("STORER", extension=".rv", parts={store.MemoryPart.REALS})
@operands.handles("STORES", extension=".st", parts={store.MemoryPart.STRINGS})
def _store(station: Station, it: Instruction, extension: str, parts: Collection[store.MemoryPart]) -> Dialogue[None]:
    """Store the memory in a file: programs and variables as selected by `parts`; if programs are named, only these and
    what they use."""
    path = _with_extension(operands.path_of(station, it), extension)
    programs = [operands.word(argument) for argument in it.arguments[1:]]
    memory, layout = station.environment.copy(), station.layout
    everything = not programs and parts == store.EVERYTHING

    def write() -> tuple[str, Sequence[Program | Section], Mapping[Item, numbers.Value]]:
        chosen = store.choose_parts(memory, parts, programs)
        return store.text_of(chosen, layout, everything=everything), chosen, store.values_of(memory, chosen)

    text, chosen, values = yield from beside(write)
    if not text.strip():
        yield results.Message("There is nothing to store", results.Tone.WARNING)
        return
    yield from operands.may_write(station, path)
    atomic.write_atomically(path, text, station.folder)
    station.unstored.programs_stored(part for part in chosen if isinstance(part, Program))
    station.unstored.values_stored(values)
    yield results.Message(f"{path} stored")


def _with_extension(path: Path, extension: str) -> Path:
    """Return the path with an extension added, unless it already has one."""
    return path if path.suffix else path.with_name(path.name + extension)


@operands.handles("SAVE")
def _save(station: Station, it: Instruction) -> Dialogue[None]:
    engine = station.engine
    path = _with_extension(operands.path_of(station, it), trajectory_file.EXTENSION)
    yield from operands.may_write(station, path)
    model, initial, deltas = engine.model, engine.book.initial, engine.book.deltas.copy()
    measured = engine.measured.view
    yield from beside(lambda: trajectory_file.write_trajectory(path, model, initial, deltas, station.folder, measured))
    yield results.Message(f"{path} saved: {numbers.count(engine.book.history.commands, 'command')}, {engine.end:.3f} s")


@operands.handles("REPLAY")
def _replay(station: Station, it: Instruction) -> Dialogue[None]:
    """Play a trajectory file on the user's screen; if there is no screen, list the motions of the file."""
    path = operands.path_of(station, it)
    path = path if path.exists() else _with_extension(path, trajectory_file.EXTENSION)
    recording = yield from _read_recording(station, path)
    yield from (results.Message(warning, results.Tone.WARNING) for warning in recording.warnings)
    timeline, title = recording.timeline, recording.model.title
    changes, segments = numbers.count(len(recording.deltas), "change"), numbers.count(len(timeline), "segment")
    yield results.Message(
        f"{path}: {title}, {changes}, {segments}, {numbers.seconds(timeline.start)} to {numbers.seconds(timeline.end)}"
    )
    named = os.path.relpath(path, station.folder.root)
    shown = station.user_state.attended and (yield from station.user_state.show(recording, questions.Playing(named)))
    if recording.dropped_tail and not shown:
        yield results.Message(TORN, results.Tone.WARNING)
    arm, holder = recording.arm, [recording]
    del recording, timeline  # the other thread then has the only reference, and frees the memory of the trajectory
    rows = yield from beside(lambda: _replay_rows(arm, holder.pop()))
    if not shown:
        yield replies.ReplayTable(rows)


def _replay_rows(arm: RobotArm, recording: trajectory_file.Recording) -> tuple[replies.ReplayRow, ...]:
    """Return the position at the end of each motion of a recording. The caller must hold no other reference to the
    recording, so that its memory is freed here in small parts: freeing a million values at once would block all
    threads."""
    timeline, deltas = recording.timeline, list(recording.deltas)
    del recording
    segments = list(timeline)
    rows = tuple(
        replies.ReplayRow(
            one.motion.number, one.motion.text, one.finish, position_at(arm, timeline, one.finish).T_world_tool
        )
        for one, follower in zip_longest(segments, segments[1:])
        if follower is None or follower.motion.number != one.motion.number
    )
    del timeline
    while deltas:
        deltas.pop()
    while segments:
        segments.pop()
    return rows


@operands.handles("FLIST")
def _list_file(station: Station, it: Instruction) -> Dialogue[None]:
    path, folder = operands.path_of(station, it), station.folder
    yield replies.FileText(
        (yield from beside(lambda: tuple(program_file.read_program_file(path, folder).splitlines())))
    )


@operands.handles("FDIRECTORY", "LISTF")
def _list_folder(station: Station, it: Instruction) -> Dialogue[None]:
    """List the files of a folder, or those that match a pattern."""
    given, folder = operands.operand(it, 0), station.folder
    path = folder.at if given is None else folder.path(operands.word(given), pattern=True)
    yield replies.FileTable(str(path), disk.entries(path, folder))


@operands.handles("CD")
def _change_folder(station: Station, it: Instruction) -> Dialogue[None]:
    """Change to a folder; without an argument, change back to the initial one. Raises FileError if the path is not a
    folder, FileOutside if it is outside a closed folder."""
    given, home = operands.operand(it, 0), station.home
    if given is None:
        station.change_folder(home)
    else:
        name, present = operands.word(given), station.folder.at
        if not home.closed:
            path = station.folder.path(name)
        elif name.strip() == "..":  # in a closed folder, `..` from its root stays at the root
            path = present if present == home.at else present.parent
        else:
            path = home.at if name.strip() == "/" else station.folder.inside(name)
        if not path.is_dir():
            raise FileError(f"{name} is no folder", "FDIRECTORY lists what there is")
        station.change_folder(structs.replace(home, root=os.path.normpath(path)))
    yield from _tell_folder(station, it)


@operands.handles("PWD")
def _tell_folder(station: Station, _it: Instruction) -> Dialogue[None]:
    """Show the path of the current folder. In a closed folder whose location is secret, show only the path inside
    it."""
    root, home = station.folder.at, station.home
    hidden = home.closed and not home.disclosed
    yield results.Message(f"/{root.relative_to(home.at).as_posix().strip('.')}" if hidden else os.path.abspath(root))


@operands.handles("LOG")
def _log(station: Station, it: Instruction) -> Dialogue[None]:
    """Begin to write the session to a file, or end this. Raises FileError, and UsageError if this robot cannot write a
    log."""
    given, log = operands.operand(it, 0), station.log
    path = None if given is None else station.folder.path(operands.word(given))
    if log is None:
        raise UsageError("LOG writes no file at this robot", "LOG is for a shell at its own robot")
    if path is not None:
        yield from operands.may_write(station, path)
        log(path)
        yield results.Message(f"{path} takes down what is typed and answered; LOG alone ends it")
    elif (done := log(None)) is None:
        raise UsageError("no LOG is written", "LOG session.txt begins one; LOG session.html keeps colours")
    else:
        yield results.Message(f"{done} is complete")


@operands.handles("FDELETE")
def _delete_file(station: Station, it: Instruction) -> Dialogue[None]:
    path = disk.check_file(operands.path_of(station, it))
    if (yield from operands.may_delete(station, f"The file {path} will be deleted.")):
        disk.delete(path, station.folder)
        yield results.Message(f"{path} deleted")


@operands.handles("FCOPY", act=disk.copy, done="copied to")
@operands.handles("FRENAME", act=disk.rename, done="renamed to")
def _copy_or_rename(
    station: Station, it: Instruction, act: Callable[[Path, Path, opening.Folder], None], done: str
) -> Dialogue[None]:
    """Copy or rename a file, as given by `new = old`. Raises FileError."""
    old = disk.check_file(station.folder.path(operands.word(it.value)))
    new = disk.target(old, operands.path_of(station, it))
    yield from operands.may_write(station, new)
    act(old, new, station.folder)
    yield results.Message(f"{old} {done} {new}")
