"""Carry out `vrs grade`: grade submissions for an exercise, and write the marks for teachers and students."""

from __future__ import annotations

import os
import shutil
import stat
import sys
from argparse import Namespace
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import chdir, closing
from glob import glob
from pathlib import Path

from vrs_cli.cli import commands, main, outputs, sources
from vrs_cli.cli.command_line import CommandLineError, refuse
from vrs_cli.errors import FileDamaged, FileError, FileOutside, NonexistentFile
from vrs_cli.files import atomic, opening, program_file
from vrs_cli.render.blocks import PIPE, Block, Column, Grid, grid_lines, line, number_column, split
from vrs_cli.render.pictures import check_page
from vrs_cli.render.plain import for_stream
from vrs_cli.render.progress import RunProgress
from vrs_cli.teach import exercise_text, findings
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import Grader, Grading, Submission, SubmissionRuns, by_student, total_of
from vrs_cli.teach.many import Graded, core_count, grade_many, grade_on_cluster
from vrs_cli.teach.propose import propose
from vrs_cli.teach.reports import results
from vrs_cli.teach.reports.pages import Pages
from vrs_cli.values.numbers import count


def find_submissions(named: Iterable[str]) -> tuple[Submission, ...]:
    """Read the submissions that files, folders and patterns name, each once, sorted by student.

    A file is named after its student, and so is a folder with one program file. In any other folder each program file
    and each subfolder is a submission. Submissions with equal names also get the names of their folders. Raises
    NonexistentFile for an argument that names no submission.
    """
    found = dict[str, Path]()
    for name in named:
        for path in _places(name):
            found.setdefault(os.path.abspath(path), path)
    paths = [Path(path) for path in found]
    read = (_read(student, path) for student, path in zip(_students(paths), paths, strict=True))
    return tuple(sorted(read, key=lambda one: (one.student.casefold(), one.student)))


def _places(name: str) -> Iterable[Path]:
    """Return the files and folders, one for each student, that an argument of the command line names."""
    path = Path(name)
    if not os.path.lexists(path) and set(name) & set("*?["):
        found = [one for each in sorted(glob(name, recursive=True)) for one in _places(each)]
        if not found:
            raise NonexistentFile(f"no file fits {name}", "name files, or folders with files of students")
        return found
    if not path.is_dir() or path.is_symlink():
        if not os.path.lexists(path):
            raise NonexistentFile(name, "name files, or folders with files of students")
        return (path,)
    inside = [one for one in sorted(path.iterdir()) if not one.name.startswith(".")]
    programs, folders = [one for one in inside if sources.is_program(one.name)], [one for one in inside if one.is_dir()]
    if (len(programs) == 1 and not any(_programs_below(one) for one in folders)) or not (programs or folders):
        return (path,)  # a folder of one student, which may contain no program
    return [*programs, *folders]


def _programs_below(folder: Path) -> list[Path]:
    """Return the program files of a student's folder, without following links to folders."""
    return sorted(
        Path(here, name)
        for here, _, names in os.walk(folder)
        for name in names
        if sources.is_program(name) and not Path(here).name.startswith(".")
    )


def _students(paths: list[Path]) -> list[str]:
    """Return a name for each path. The names are as short as possible, and no two are equal."""
    own = [path.stem if sources.is_program(path.name) else path.name for path in paths]
    depth, names = 1, list[str]()
    while depth <= 64:
        names = ["/".join((*path.parts[-depth:-1], name)) for path, name in zip(paths, own, strict=True)]
        if len({name.casefold() for name in names}) == len(names):
            break
        depth += 1
    last = {name.rpartition("/")[2] for name in names}
    if depth > 1 and len(last) == 1:  # the folders are the names, as in ann/robot.v2 and bob/robot.v2
        names = [name.rpartition("/")[0] for name in names]
    return [_text_of_name(name) for name in names]


def _text_of_name(name: str) -> str:
    """Return a file name as text, shortened to its last 200 characters; bytes that are not valid characters are
    escaped."""
    return os.fsencode(name).decode(errors="backslashreplace")[-200:]


def _read(student: str, path: Path) -> Submission:
    """Read a submission. Links are not followed, because a link could lead to a file of another person."""
    if path.is_dir() and not path.is_symlink():
        programs = _programs_below(path)
        if len(programs) != 1:
            many = f"the folder holds {len(programs)} program files, and one is wanted"
            return Submission(student, _text_of_name(path.name), "", many)
        path = programs[0]
    name = _text_of_name(path.name)
    try:
        # open the file without following links
        with opening.Folder(path.parent, closed=True).open_to_read(path) as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                raise FileError("it is no file")
            data = stream.read(exercise_text.MAX_PROGRAM_BYTES + 1)
        if len(data) > exercise_text.MAX_PROGRAM_BYTES:
            raise FileError(f"it has more than {exercise_text.MAX_PROGRAM_BYTES} bytes")
        return Submission(student, name, program_file.decode_program(path.name, data))
    except FileOutside:
        why = "it is a link, a device or a pipe"
    except FileError as error:
        why = error.detail
    except OSError as error:
        why = opening.reason(error)
    return Submission(student, name, "", f"the file cannot be read: {why}")


FILES = ("json", "junit", "csv", "gradescope", "check50")  # options that name an output file
# options whose file describes one submission; for several submissions they name a folder
FOR_ONE = ("gradescope", "check50")


def grade(options: Namespace) -> int:
    """Grade all submissions, or check an exercise. Return 1 if a submission could not be graded, or if the exercise has
    mistakes."""
    if options.check is not None:
        if options.exercise is not None:
            raise CommandLineError("--check grades no submissions", f"vrs grade --check {options.check}")
        return _check_exercise(options)
    if options.new is not None:
        # Write an exercise that is proposed from a solution, and print what was proposed
        if options.exercise is None or options.files:
            raise CommandLineError("--new wants a name and one solution", "vrs grade --new pick solution.v2")

        folder, proposed = propose(options.new, options.exercise, options.cell)
        for text in (*proposed, f"{folder} is written: complete exercise/text.md; then vrs grade --check {folder}"):
            print(for_stream(text, sys.stdout))
        return main.OK
    incomplete = options.exercise is None or not options.files
    refuse(
        (options.cell is not None, "--cell is for --new: submissions run in the cell of the exercise", ""),
        (incomplete, "an exercise and submissions are wanted", "vrs grade pick class"),
    )
    exercise = read_exercise(exercise_text.find_exercise(options.exercise).resolve())
    submissions = find_submissions(options.files)
    _check_outputs(options, len(submissions) > 1)
    gradings = _grade_all(options, exercise, submissions)
    return main.FAILED if any(one.lost for one in gradings) else main.OK


def _check_exercise(options: Namespace) -> int:
    """Print the mistakes of an exercise as they are found; return the exit status."""
    from tempfile import TemporaryDirectory

    try:
        exercise = read_exercise(exercise_text.find_exercise(options.check).resolve())
    except FileDamaged as error:
        print(error.detail)
        print(f"{count(error.detail.count(chr(10)) + 1, 'mistake')} ({error.hint})")
        return main.FAILED
    mistakes = warnings = 0
    with TemporaryDirectory(prefix="vrs-grade-", ignore_cleanup_errors=True) as folder, chdir(folder):
        for found in findings.findings_of(exercise, lambda it, text: SubmissionRuns(Submission("", "", text)).run(it)):
            print(for_stream(found.text, sys.stdout), flush=True)
            mistakes, warnings = mistakes + (not found.doubtful), warnings + found.doubtful
    if not mistakes and not warnings:
        print(f"{exercise.title}: no mistakes in {count(len(exercise.checks), 'check')}")
    else:
        print(f"{count(mistakes, 'mistake')} and {count(warnings, 'warning')}")
    return main.FAILED if mistakes else main.OK


def _grade_all(options: Namespace, exercise: Exercise, submissions: Sequence[Submission]) -> tuple[Grading, ...]:
    """Grade all submissions, print a table, and write all files; return the gradings."""
    grader = Grader(exercise)
    pages = None
    if options.html is not None:
        pages = Pages(Path(options.html), exercise)
        pages.name(one.student for one in submissions)
    found, total = list[Grading](), len(submissions)
    progress_bar = RunProgress("grading", total, shown_as=lambda done: f"{done:.0f} of {total}")
    try:
        with progress_bar as progress, closing(_gradings(options, grader, submissions)) as arriving:
            for one in arriving:
                found.append(one.grading)
                if pages is not None:
                    pages.add(one.grading, one.replay)
                progress(len(found))
    except KeyboardInterrupt:
        _show(exercise, by_student(found), ())
        print(
            f"{options.prog}: {len(found)} of {count(total, 'submission')} graded; no file of results is written",
            file=sys.stderr,
        )
        raise
    gradings = by_student(found)
    # program text that all students were given, which does not count as copied
    given = (Path(exercise.folder, "exercise", name) for name in ("given.v2", "start.v2"))
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in given if path.is_file()]
    alike = results.similar({one.student: one.text for one in submissions}, texts, exercise.similar)
    contents = results.results_object(exercise, gradings, alike)
    _write(options, exercise, gradings, contents)
    if pages is not None:
        pages.finish(gradings, alike, contents["digest"], next(iter(grader.models.values())).arm)
    if not options.quiet and commands.STANDARD_STREAM not in (getattr(options, name) for name in FILES):
        _show(exercise, gradings, alike)
        print(f"digest {contents['digest']}")
    return gradings


def _gradings(options: Namespace, grader: Grader, submissions: Sequence[Submission]) -> Generator[Graded, None, None]:
    """Yield the gradings of all submissions, computed on this machine or by the workers of a Dask scheduler."""
    replays = options.html is not None
    if options.dask is None:
        return grade_many(grader, submissions, options.jobs or core_count(), replays=replays)

    return grade_on_cluster(options.dask, grader.exercise, submissions, replays=replays)


# --- outputs ---------------------------------------------------------------------------------------------------------


def _check_outputs(options: Namespace, several: bool) -> None:
    """Check now that all output files can be written after grading. Raises CommandLineError, FileError, PageError."""
    named = {name: path for name in FILES if (path := getattr(options, name)) is not None}
    if list(named.values()).count(commands.STANDARD_STREAM) > 1:
        raise CommandLineError("two outputs want standard output", "write one into a file")
    outputs.check_distinct(path for path in named.values() if path != commands.STANDARD_STREAM)
    for name, path in named.items():
        if name in FOR_ONE and several:
            if path == commands.STANDARD_STREAM or (os.path.lexists(path) and not os.path.isdir(path)):
                what = f"--{name} {path} is one file, and there are several submissions"
                raise CommandLineError(what, f"name a folder, in which each has a file: --{name} marks")
        elif path != commands.STANDARD_STREAM:
            atomic.check_writable(path)
    if options.html is not None:
        check_page()


def _write(options: Namespace, exercise: Exercise, gradings: Sequence[Grading], contents: dict[str, object]) -> None:
    """Write all files. Raises FileError."""
    if options.json is not None:
        outputs.write_text(options.json, results.written_json(contents))
    if options.csv is not None:
        outputs.write_text(options.csv, results.gradebook(exercise, gradings))
    if options.junit is not None:
        outputs.write_text(options.junit, results.junit(exercise, gradings))
    for name in FOR_ONE:
        path = getattr(options, name)
        if path is not None and len(gradings) == 1:
            outputs.write_text(path, results.written_json(results.FOR_STUDENTS[name](exercise, gradings[0])))
        elif path is not None:
            outputs.make_folder(path, path, "name another folder")
            taken = set[str]()
            for one in gradings:
                file = Path(path, f"{results.file_stem(one.student, taken)}.json")
                outputs.write_text(str(file), results.written_json(results.FOR_STUDENTS[name](exercise, one)))


def _show(exercise: Exercise, gradings: Sequence[Grading], alike: Iterable[results.Likeness]) -> None:
    """Print a table of all gradings, and the pairs of similar submissions."""
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else PIPE.width
    for block in _blocks(exercise, gradings, alike):
        for part in split(block, width) if isinstance(block, Grid) else (block,):
            for row in grid_lines(part) if isinstance(part, Grid) else (part,):
                print(row.text.rstrip())


def _blocks(exercise: Exercise, gradings: Sequence[Grading], alike: Iterable[results.Likeness]) -> Iterator[Block]:
    of = results.points_text(total_of(exercise))
    columns = (Column("student"), number_column("points", 6), number_column("of", 4), Column("why", fold=True))
    rows = (
        (
            results.plain(one.student),
            "-" if one.lost else results.points_text(one.points),
            of,
            results.plain(_reason(one)),
        )
        for one in gradings
    )
    yield Grid(columns, tuple(rows))
    graded = [one.points for one in gradings if not one.lost]
    mean = (
        f", {results.points_text(round(sum(graded) / len(graded), 2))} of {of} points on the average" if graded else ""
    )
    lost = len(gradings) - len(graded)
    yield line(f"{count(len(graded), 'submission')} graded{f', {lost} not' if lost else ''}{mean}")
    pairs = tuple((results.plain(one.first), results.plain(one.second), f"{one.similarity:.0%}") for one in alike)
    if pairs:
        yield line()
        yield Grid((Column("similar"), Column(""), number_column("by", 5)), pairs)


def _reason(grading: Grading) -> str:
    """Return, in one line, why a submission was not graded, or which failed check cost the most points, and why it
    failed."""
    if grading.lost:
        return f"not graded: {grading.lost}"
    if grading.stopped:
        return grading.stopped
    wrong = [found for _, found in grading.marks if not found.passed]
    if not wrong:
        return ""
    worst = max(wrong, key=lambda found: found.of - found.points)
    more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
    return f"{worst.name}: {worst.reason}{more}"
