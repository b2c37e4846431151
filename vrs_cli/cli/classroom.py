"""Carry out `vrs class` and `vrs class token`: create the folder of a class whose students work in browsers; print
links and tokens; collect programs; remove students."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from urllib.parse import quote, urlsplit

from vrs_cli.cli.command_line import CommandLineError, refuse
from vrs_cli.errors import FileDamaged
from vrs_cli.files import atomic, opening
from vrs_cli.net import tokens
from vrs_cli.values.numbers import count


def class_(options: Namespace) -> None:
    """Carry out an action (`new`, `links`, `collect`, `forget`) on the folder of a class. Raises CommandLineError,
    FileError, UsageError."""
    folder = tokens.ClassFolder(Path(options.folder))
    own = {"names": "new", "at": "links", "to": "collect"}
    misplaced = (name for name, action in own.items() if getattr(options, name) and options.action != action)
    wrong = next(misplaced, "")
    is_class = options.action == "new" or folder.tokens.exists()
    refuse(
        (wrong, f"--{wrong} is for vrs class {own.get(wrong)}", ""),
        (not is_class, f"{folder.root} is no class", f"vrs class new {folder.root} NAME ..."),
    )
    {"new": _make, "links": _print_links, "collect": _collect, "forget": _forget}[options.action](folder, options)


def _make(folder: tokens.ClassFolder, options: Namespace) -> None:
    """Create a class, or add students to it."""
    listed = "" if options.names is None else opening.text_at(str(Path(options.names)), 100_000)
    names = [*options.students, *filter(None, map(str.strip, listed.splitlines()))]
    folded = [name.casefold() for name in names]
    for name in names:
        good = tokens.good_name(name) and name.casefold() != tokens.TEACHER_NAME
        refuse(
            (not good, f"{name!r} is no name for a student", tokens.NAME_RULE),
            (folded.count(name.casefold()) > 1, f"{name} is there twice", "give each a name of its own"),
        )
    refuse((not names, "a class has students", f"vrs class new {folder.root} NAME ..., or --names FILE"))
    before = folder.tokens.read_bytes() if folder.tokens.exists() else None
    folder.make(names)
    try:
        tokens.TokenFile(folder.tokens, (), tokens.OWN_ROBOTS)
    except FileDamaged as error:  # restore the old file, because with the new one two students would share a robot
        if before is None:
            folder.tokens.unlink()
        else:
            atomic.write_atomically(folder.tokens, before.decode())
        raise CommandLineError(error.detail, error.hint) from None
    print(f"{folder.root}: {count(len(folder.students()), 'student')}; vrs class links {folder.root} tells their links")


def _print_links(folder: tokens.ClassFolder, options: Namespace) -> None:
    """Print a line for each person: the name and the link to the robot."""
    at = urlsplit(options.at or "http://127.0.0.1:8765")
    is_server = at.scheme in ("http", "https") and at.netloc and not (at.path.strip("/") or at.query or at.fragment)
    refuse((not is_server, f"--at {options.at}", "https://HOST:PORT, as students reach the server"))
    students, teachers = folder.students(), folder.teachers()
    wanted = options.students or [*teachers, *students]
    unknown = next((name for name in wanted if name not in {**students, **teachers}), None)
    refuse((unknown, f"{unknown} is not in {folder.root}", f"there is {', '.join(students) or 'nobody'}"))
    for name in wanted:
        where, token = (f"view/{name}", students[name]) if name in students else ("wall", teachers[name])
        print(f"{name} {at.scheme}://{at.netloc}/{where}#token={quote(token, safe='')}")


def _collect(folder: tokens.ClassFolder, options: Namespace) -> None:
    """Copy the newest program of each student, and print the names of students without a program."""
    refuse((options.students, "collect takes the programs of all", f"vrs class collect {folder.root}"))
    target = Path(options.to) if options.to else folder.collected_folder
    found = folder.collect(target)
    for student, path in found.items():
        print(f"{student} {path.name}")
    missing = [student for student in folder.students() if student not in found]
    print(f"{count(len(found), 'program')} in {target}" + (f"; nothing of {', '.join(missing)}" if missing else ""))


def _forget(folder: tokens.ClassFolder, options: Namespace) -> None:
    """Remove students, with their tokens and all their files."""
    refuse((not options.students, "whom to forget?", f"vrs class forget {folder.root} NAME"))
    for student in options.students:
        folder.forget(student)
        print(f"{student} is removed, with all files")


# --- vrs class token ------------------------------------------------------------------------------------------------


def token(options: Namespace) -> None:
    """Print a line for each name: the name and its token. With --revoke remove the tokens instead."""
    wrong = next((name for name in options.names if not tokens.good_name(name)), None)
    refuse((wrong is not None, f"{wrong!r} is no name", tokens.NAME_RULE))
    path = Path(options.file)
    if options.revoke:
        tokens.take_out(path, options.names)
        return
    robots = None if options.robots is None else tuple(filter(None, options.robots.split(",")))
    for name, token in tokens.add_tokens(path, options.names, options.role, robots, options.expires).items():
        print(f"{name} {token}")
