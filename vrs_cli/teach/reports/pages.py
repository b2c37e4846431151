"""Write HTML pages: one for each student with marks, curves and a replay of the failure, and one for teachers.

The students' folder has one viewer for all students, and one recording per student. Students get that folder; the
teacher's page is beside it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileError
from vrs_cli.files.atomic import write_atomically
from vrs_cli.interfaces.monitor.timeline import plot_curves, select_curves
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.net.page_data import moments, robot
from vrs_cli.render.documents import picture
from vrs_cli.render.pictures import replay, viewer
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import Grading, total_of
from vrs_cli.teach.judging.basis import Evidence
from vrs_cli.teach.reports.results import Likeness, ShownMark, file_stem, plain, points_text, shown_marks

BEFORE, AFTER = 3.0, 1.0  # [s] time that a replay shows before and after the failure
MAX_REPLAY_S = 20.0  # [s] maximum length of a replay, which shows the end of the run, if the failure has no time
STUDENTS, REPLAYS, VIEWER, TEACHER = "students", "replays", "viewer.html", "teacher.html"
POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-src 'self' file:"
STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#222}"
    "table{border-collapse:collapse;width:100%}td,th{padding:.25rem .8rem;text-align:left;vertical-align:top;"
    "border-bottom:1px solid #ddd}.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}"
    ".lost{color:#b00000}.hint{color:#555}iframe{width:100%;height:40rem;border:1px solid #ddd}"
    "svg{max-width:100%;height:auto}td{overflow-wrap:anywhere}@media print{iframe{display:none}}"
    "th.n{white-space:normal;min-width:5em}td:last-child{min-width:12em}"
)


class Replay(Struct, frozen=True):
    """The run that a page shows.

    The fields are the number of the variant (0: the unchanged exercise), the time at which the first lost mark can be
    seen [s] or None, curves as SVG, and the recording for the viewer.
    """

    variant: int
    at: float | None
    curves: tuple[str, ...]
    recording: str


def replay_of(exercise: Exercise, grading: Grading, runs: Sequence[Evidence | None]) -> Replay | None:
    """Return the replay of one run: the run with the first lost mark that has a time; if there is none, the run with
    the first lost mark; if no mark was lost, the first run. Return None if the submission did not run in this
    variant."""
    lost = [one for one in shown_marks(exercise, grading) if not one.passed and one.reason]
    failed = next((one for one in lost if one.at is not None), lost[0] if lost else None)
    variant = failed.variant if failed is not None else 0
    run = runs[variant] if variant < len(runs) else None
    if run is None or run.timeline.end <= run.timeline.start:
        return None
    at = failed.at if failed is not None else None
    timeline = run.timeline
    curves = (plot_curves(run.arm, timeline, select_curves(run.arm, (word,))) for word in ("TOOL", "POSITION", "SPEED"))
    begin, end = (timeline.end - MAX_REPLAY_S, timeline.end) if at is None else (at - BEFORE, at + AFTER)
    between = max(begin, timeline.start), min(end, timeline.end)
    cell = None if run.course is None else run.cell
    shown = moments(run.arm, timeline, title=plain(exercise.title), cell=cell, between=between)
    return Replay(variant, at, tuple(picture(plot, at) for plot in curves), replay(shown))


class Pages:
    """A writer of pages into a folder: `add` writes the page of a student; `finish` writes the common files and the
    teacher's page."""

    def __init__(self, folder: Path, exercise: Exercise) -> None:
        """Make the folder. Raises FileError if it cannot be made."""
        self._folder, self._exercise = folder, exercise
        self._files, self._taken = dict[str, str](), {Path(VIEWER).stem}
        try:
            (folder / STUDENTS / REPLAYS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{folder}: {error.strerror}", "name another folder") from None

    def name(self, students: Iterable[str]) -> None:
        """Choose the file name of each student's page; names that collide are numbered in the order of `students`."""
        self._files |= {student: file_stem(student, self._taken) for student in students}

    def add(self, grading: Grading, replay: Replay | None) -> None:
        """Write the page and the recording of a student. Raises FileError."""
        stem, folder = self._files[grading.student], self._folder / STUDENTS
        if replay is not None:
            write_atomically(folder / REPLAYS / f"{stem}.js", replay.recording)
        write_atomically(folder / f"{stem}.html", student_page(self._exercise, grading, replay, stem))

    def finish(self, gradings: Sequence[Grading], alike: Sequence[Likeness], digest: str, arm: RobotArm) -> None:
        """Write the viewer and the teacher's page. Raises FileError."""
        write_atomically(self._folder / STUDENTS / VIEWER, viewer(robot(arm)))
        write_atomically(self._folder / TEACHER, teacher_page(self._exercise, gradings, alike, digest, self._files))


# --- pages as text ---------------------------------------------------------------------------------------------------


def student_page(exercise: Exercise, grading: Grading, replay: Replay | None, stem: str) -> str:
    """Return the page of a student. It shows only the total points of hidden checks."""
    title = f"{plain(exercise.title)}: {plain(grading.student)}"
    if grading.lost:
        why = f'<p class="lost">Not graded: {escape(plain(grading.lost))}.</p><p>This is no mark.</p>'
        return _page(title, f"{_heading(exercise, grading)}{why}")
    stopped = (
        f'<p class="lost">The program stopped: {escape(plain(grading.stopped))}</p>'
        if grading.stopped
        else "<p>The program ran to its end.</p>"
    )
    rows = "".join(_mark_row(one) for one in shown_marks(exercise, grading))
    head = '<tr><th>Check</th><th class="n">Points</th><th>Why</th></tr>'
    total = f"<p><b>{points_text(grading.points)} of {points_text(total_of(exercise))} points</b></p>"
    parts = [_heading(exercise, grading), total, stopped, f"<table>{head}{rows}</table>"]
    if replay is not None:
        place = f" in variant {replay.variant}" if replay.variant else ""
        what = f"The moment at {replay.at:.2f} s{place}" if replay.at is not None else f"The run{place}"
        parts += [
            f"<h2>{what}</h2>",
            f'<iframe src="{VIEWER}#{stem}" title="{what}, in 3-D" loading="lazy"></iframe>',
            *(f"<p>{curve}</p>" for curve in replay.curves),
        ]
    return _page(title, "".join(parts))


def _heading(exercise: Exercise, grading: Grading) -> str:
    title, student = escape(plain(exercise.title)), escape(plain(grading.student))
    return f"<h1>{title}</h1><p><bdi>{student}</bdi>, <bdi>{escape(plain(grading.file))}</bdi></p>"


def _mark_row(one: ShownMark) -> str:
    points = f"{points_text(one.points)} / {points_text(one.of)}"
    hint = f'<br><span class="hint">Hint: {escape(one.hint)}</span>' if one.hint else ""
    lost = "" if one.passed else ' class="lost"'
    why = f"<span{lost}>{escape(one.reason_text)}</span>{hint}"
    return f'<tr><td>{escape(one.name)}</td><td class="n">{points}</td><td>{why}</td></tr>'


def teacher_page(
    exercise: Exercise, gradings: Sequence[Grading], alike: Sequence[Likeness], digest: str, files: dict[str, str]
) -> str:
    """Return the page for teachers: all marks with their reasons, including hidden ones, and similar submissions."""
    checks = "".join(
        f'<th class="n">{escape(plain(one.name))}{" (hidden)" if one.hidden else ""}</th>' for one in exercise.checks
    )
    head = f'<tr><th>Student</th><th class="n">Points</th>{checks}</tr>'
    rows = "".join(_grading_row(exercise, one, files.get(one.student, "")) for one in gradings)
    graded = [one.points for one in gradings if not one.lost]
    mean = f", {points_text(sum(graded) / len(graded))} points on the average" if graded else ""
    parts = [
        f"<h1>{escape(plain(exercise.title))}</h1>",
        f"<p>{len(gradings)} submissions, {len(graded)} graded{mean}, of {points_text(total_of(exercise))}.</p>",
        f"<table>{head}{rows}</table>",
    ]
    if alike:
        pairs = "".join(
            f"<tr><td><bdi>{escape(plain(one.first))}</bdi></td><td><bdi>{escape(plain(one.second))}</bdi></td>"
            f'<td class="n">{one.similarity:.0%}</td></tr>'
            for one in alike
        )
        parts += [
            "<h2>Similar submissions</h2><p>How much of their words, whatever names they use, two have in common. "
            "Short programs for one task are often alike.</p>",
            f'<table><tr><th>Student</th><th>Student</th><th class="n">Similarity</th></tr>{pairs}</table>',
        ]
    parts.append(f"<p>Digest of all results (SHA-256): <code>{escape(digest)}</code></p>")
    return _page(plain(exercise.title), "".join(parts))


def _grading_row(exercise: Exercise, grading: Grading, stem: str) -> str:
    name = f'<a href="{STUDENTS}/{stem}.html"><bdi>{escape(plain(grading.student))}</bdi></a>'
    width = len(exercise.checks) + 1
    if grading.lost:
        why = f'<td class="lost" colspan="{width}">not graded: {escape(plain(grading.lost))}</td>'
        return f"<tr><td>{name}</td>{why}</tr>"
    cells = "".join(
        f'<td class="n{" lost" * (not one.passed)}" title="{escape(plain(one.reason))}">{points_text(one.points)}</td>'
        for _, one in grading.marks
    )
    row = f'<tr><td>{name}</td><td class="n"><b>{points_text(grading.points)}</b></td>{cells}</tr>'
    if grading.stopped:
        row += f'<tr><td></td><td class="hint" colspan="{width}">{escape(plain(grading.stopped))}</td></tr>'
    return row


def _page(title: str, body: str) -> str:
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>{body}</body></html>\n"
    )
