"""Parse VAL-II text to syntax trees with one grammar (grammar/val2.lark): lines, files, and the parts of a file.

A mistake in a single line raises LineRefused. For a file, the mistakes of all lines are returned as diagnostics,
because each line is parsed separately. This module also reads the layout of files: programs, sections of variables,
step numbers of old listings, files in other makers' languages, and comments that suppress warnings. The comment
`; vrs: ignore V401, V056` at the end of a line applies to that line, `; vrs: ignore-file V401` to the whole file;
without codes, all warnings are suppressed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, cached_property
from itertools import pairwise
from typing import Any, Final, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import CannotInterpret, ControlStructure, FileDamaged, ProgramExists, TypeMismatch, did_you_mean
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import (
    ANGLES,
    AXES,
    FUNCTION_NAMES,
    BadLine,
    Comment,
    Entry,
    File,
    Program,
    ProgramHeader,
    Section,
    Statement,
    Step,
    resolve_program,
    variables_named_like_functions,
)
from vrs_cli.language.text.builder import ValBuilder
from vrs_cli.language.text.line_parser import LineParser
from vrs_cli.language.words.foreign import FOREIGN_COMMENT, OWN_COMMENT
from vrs_cli.language.words.values import NAME_LENGTH, key_of
from vrs_cli.values.diagnostics import (
    DIALECTS,
    Diagnostic,
    DiagnosticCollector,
    Dialect,
    LineRefused,
    Severity,
    Span,
    error,
    in_order,
)
from vrs_cli.values.numbers import count

V = TypeVar("V")

PROGRAM, END = ".PROGRAM", ".END"
IN_ANOTHER_FILE = "is in another of these files too"
MAX_TRIED = 200  # in a file without a heading, test at most this many lines for being steps
# refuse longer steps and entries, because the time of some regular expressions grows with the square of the length
MAX_LINE_CHARS = 4000
JOINTS_HIGH = 12  # maximum number of joints of a precision point in a file
SECTIONS = (".LOCATIONS", ".REALS", ".DOUBLES", ".STRINGS")

_DIRECTIVE = re.compile(r"[ \t]*(\.[A-Za-z][\w.]*)")
_BINARY = re.compile(r"[\x00-\x06\x0e-\x19\x1c-\x1f]")
_STEP_NUMBER = re.compile(r"[ \t]*([0-9]+)\.?(?![\w.])(?:[ \t]*\?)?[ \t]*")  # matches 3 or 3. or 3.?
DISK_END = "\x1a"  # Ctrl-Z, which marks the end of a text file on old disks


def header_end(text: str) -> int | None:
    """Return the index after `.PROGRAM` if a line begins with this word, otherwise None."""
    match = _DIRECTIVE.match(text)
    return match.end() if match is not None and match[1].upper() == PROGRAM else None


class SourceLine(Struct, frozen=True):
    """A line of a file. `number`: the line number from 1; `directive`: the first word in upper case if it begins with a
    dot (`.PROGRAM`, `.END`), otherwise ""."""

    number: int
    text: str
    directive: str

    @property
    def span(self) -> Span:
        """Return the span of the text without the blanks around it."""
        begin = len(self.text) - len(self.text.lstrip())
        return Span(self.number, begin + 1, max(len(self.text.rstrip()), begin) + 1)


def lines_of(text: str) -> list[SourceLine]:
    """Split a string into lines. Lines may end with LF, CR LF or CR."""
    text = text.rstrip(DISK_END).removeprefix("\ufeff")
    texts = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if texts and not texts[-1]:
        texts.pop()
    found = (_DIRECTIVE.match(line) if "." in line else None for line in texts)
    return [
        SourceLine(number, line, "" if match is None else match[1].upper())
        for number, (line, match) in enumerate(zip(texts, found, strict=True), 1)
    ]


def cut(lines: Sequence[SourceLine]) -> Iterator[Sequence[SourceLine]]:
    """Cut a file before each heading of a program or a section, and yield the pieces. The first piece holds the lines
    above the first heading, if there are any."""
    headings = (i for i, line in enumerate(lines) if i and (line.directive == PROGRAM or line.directive in SECTIONS))
    return (lines[begin:end] for begin, end in pairwise((0, *headings, len(lines))))


def end_of(lines: Iterable[SourceLine]) -> int | None:
    """Return the index of the first `.END` line, or None."""
    return next((i for i, line in enumerate(lines) if line.directive == END), None)


def named_above(text: str, what: str) -> tuple[str, Span] | None:
    """Return the value of a setting in a comment above the first program (`; dialect: val2`, `; robot: cobra600`), and
    the span of the comment; None if there is no such comment. `what`: the setting, such as "dialect"."""
    return next(_named_above(text, what, r"\S+"), None)


def files_named_above(text: str) -> Iterator[tuple[str, Span]]:
    """Yield the files that comments above the first program name as needed (`; with: lib.v2, grip.v2`), each with the
    span of its comment."""
    for names, span in _named_above(text, "with", r"[^\s,]+(?:[ \t]*,[ \t]*[^\s,]+)*"):
        yield from ((name.strip(), span) for name in names.split(","))


def _named_above(text: str, what: str, pattern: str) -> Iterator[tuple[str, Span]]:
    if what not in text.lower():
        return
    comment = re.compile(rf"(?i)\s*;[ \t]*{what}[ \t]*[:=][ \t]*({pattern})")
    for line in lines_of(text):
        if line.directive:
            return
        if (match := comment.match(line.text)) is not None:
            yield match[1], line.span


def programs_headed(text: str) -> frozenset[str]:
    """Return the keys of the programs in a file. Only the headings are read, so the programs may contain mistakes."""
    return frozenset(key_of(name) for name in re.findall(r"(?im)^[ \t]*\.PROGRAM[ \t]+([A-Z][\w.]*)", text))


def dialect_in(text: str, usual: Dialect) -> tuple[Dialect, tuple[Diagnostic, ...]]:
    """Return the dialect that a comment in a file names (otherwise `usual`), and an error if this dialect is
    unknown."""
    word, span = named_above(text, "dialect") or (usual.name, None)
    if span is None or word.lower() in DIALECTS:
        return Dialect[word.upper()], ()
    return usual, (error(CannotInterpret, span, f"there is no dialect {word}", f"there are {', '.join(DIALECTS)}"),)


class FileReader(DiagnosticCollector):
    """A reader of one file, line by line, which continues after each mistake. `remembered`: keep the parsed steps in
    the parser's cache, for files that are read again after small changes."""

    def __init__(self, parser: LineParser, dialect: Dialect = Dialect.VPLUS, *, remembered: bool = True) -> None:
        super().__init__()
        self._parser, self._dialect = parser, dialect
        self._read_step = parser.step if remembered else parser.new_step
        self._damaged = False  # whether the text has characters that cannot occur in a program file

    def read(self, text: str, name: str = "") -> tuple[File, tuple[Diagnostic, ...]]:
        """Return the parsed file and all mistakes in its lines. `name`: the name of the file, from which a program
        without a heading gets its name; "" refuses steps without a heading."""
        self._damaged = _BINARY.search(text.rstrip(DISK_END)) is not None
        lines = lines_of(text)
        bare = bool(name) and self._has_bare_steps(lines)
        file = File(tuple(self._bare_program(lines, name) if bare else self._all_parts(lines)))
        self.diagnostics += repeated_programs((part, 0) for part in file.parts if isinstance(part, Program))
        return file, in_order(self.diagnostics)

    # --- parts ---

    def _all_parts(self, lines: Sequence[SourceLine]) -> Iterator[Program | Section | Comment | BadLine]:
        return (part for some in cut(lines) if some for part in self._parts(some))

    def _parts(self, lines: Sequence[SourceLine]) -> Iterator[Program | Section | Comment | BadLine]:
        """Yield the program or section at the start of the lines, and then the lines after its `.END`."""
        head, end = lines[0], -1
        if head.directive == PROGRAM or head.directive in SECTIONS:
            if (found := end_of(lines)) is None:
                self.warn(ControlStructure, head.span, f"{head.directive} has no .END")
            end = len(lines) if found is None else found
            yield (self._program if head.directive == PROGRAM else self._section)(head, lines[1:end])
        stray = damaged = False
        for line in lines[end + 1 :]:
            text = line.text.strip()
            if not text or text.startswith(";"):
                yield Comment(text[1:].rstrip() if text else None, span=line.span)
            else:
                damage = self._damage_in(line)
                if damage is None:
                    self._refuse_outside(line, stray)
                elif not damaged:  # report only the first damaged line
                    self.diagnostics.append(damage)
                damaged = damaged or damage is not None
                yield BadLine(text, span=line.span)
            stray = bool(text) and not text.startswith((";", "."))

    def _refuse_outside(self, line: SourceLine, stray: bool) -> None:
        """Report a line outside of programs and sections, but only the first of several consecutive ones. `stray`: the
        previous line was also outside."""
        if line.directive == END:
            self.fault(ControlStructure, line.span, ".END without .PROGRAM or a section before it")
        elif line.directive or not stray:
            near = did_you_mean(line.directive, (PROGRAM, END, *SECTIONS)) if line.directive else ""
            foreign = re.match(FOREIGN_COMMENT, line.text.lstrip())
            self.fault(
                CannotInterpret,
                line.span,
                "this stands outside of programs",
                near or (OWN_COMMENT if foreign else "a program begins with .PROGRAM name"),
            )

    def _damage_in(self, line: SourceLine) -> Diagnostic | None:
        """Return an error for the first character that cannot occur in a program file, or None."""
        if not self._damaged or (found := _BINARY.search(line.text)) is None:
            return None
        span = Span(line.number, found.start() + 1, found.start() + 2)
        return error(FileDamaged, span, f"character {ord(found[0])} in a text", "a program file is VAL-II text")

    def _check_text(self, line: SourceLine) -> None:
        """Check a line for characters that cannot occur in a program file, and check its length. Raises LineRefused."""
        if len(line.text) > MAX_LINE_CHARS:
            raise LineRefused(
                error(
                    CannotInterpret,
                    line.span,
                    f"a line of {len(line.text)} characters",
                    f"{MAX_LINE_CHARS} at most: give it in parts",
                )
            )
        if (damage := self._damage_in(line)) is not None:
            raise LineRefused(damage)

    # --- programs ---

    def _has_bare_steps(self, lines: Sequence[SourceLine]) -> bool:
        """Return whether a file is a program without a heading: it has no `.PROGRAM`, and most of its lines parse as
        steps."""
        if any(line.directive == PROGRAM for line in lines):
            return False
        steps = [line for line in _body(lines) if line.text.strip() and not line.text.lstrip().startswith(";")]
        read = 0
        for line in steps[:MAX_TRIED]:
            with suppress(LineRefused):
                self._check_text(line)
                self._read_step(line.text, line.number)
                read += 1
        return 2 * read > min(len(steps), MAX_TRIED)

    def _bare_program(self, lines: Sequence[SourceLine], name: str) -> Iterator[Program | Section | Comment | BadLine]:
        """Yield the program of a file that begins without a heading, and the parts of the file after it."""
        called = program_name(name)
        body = _body(lines)
        heading = SourceLine(1, f"{PROGRAM} {called}()", PROGRAM)
        span = next(line for line in body if line.text.strip()).span
        self.warn(
            ControlStructure,
            span,
            f"no {PROGRAM} before this: it is the program {called}",
            "a program begins with .PROGRAM name",
        )
        yield self._program(heading, body)
        behind = len(body) + (len(body) < len(lines) and lines[len(body)].directive == END)
        yield from self._all_parts(lines[behind:])

    def _program(self, line: SourceLine, body: Sequence[SourceLine]) -> Program | BadLine:
        """Return a program. If its heading cannot be parsed, report this, check the steps, and return a BadLine."""
        header = self._read_or_report(line, self._parser.header, line.text, line.number, header_end(line.text))
        numbered = step_numbers([inner for inner in body if len(inner.text) <= MAX_LINE_CHARS])
        written = next((i for i in range(len(body), 0, -1) if body[i - 1].text.strip()), 0)
        steps = tuple(self._step(inner, numbered) for inner in body[:written])
        if header is None:
            return BadLine(line.text.strip(), span=line.span)
        program = Program(header.name, header.parameters, steps, header.comment, self._dialect, span=header.span)
        return resolve_program(program)

    def _read_or_report(self, line: SourceLine, read: Callable[..., V], *given: Any) -> V | None:
        """Return `read(*given)`, where `read` parses the line. If the line is refused, report this and return None."""
        try:
            self._check_text(line)
            return read(*given)
        except LineRefused as refused:
            self.diagnostics.append(refused.diagnostic)
            return None

    def _step(self, line: SourceLine, numbered: bool) -> Step:
        text = line.text
        if not text or text.isspace():
            return Step(None, None, None, span=Span(line.number, 1, 1))
        if numbered:
            text = _STEP_NUMBER.sub(lambda match: " " * len(match[0]), text, count=1)
        step = self._read_or_report(line, self._read_step, text, line.number)
        return Step(None, BadLine(text.strip(), span=line.span), None, span=line.span) if step is None else step

    # --- sections of variables ---

    def _section(self, line: SourceLine, body: Sequence[SourceLine]) -> Section:
        """Return a section. If one of its lines is wrong, its `whole` is False, so that its values are not loaded."""
        before = len(self.diagnostics)
        entries: list[Entry] = []
        remarks: list[tuple[int, str | None]] = []
        goes_on = False  # whether the line above is a transformation whose numbers may continue in this line
        for inner in body:
            try:
                self._check_text(inner)
                more = self._parser.numbers(inner.text) if goes_on else None
                if more is not None:
                    above, (numbers, comment) = entries[-1], more
                    comments = [one for one in (above.comment, comment) if one is not None]
                    shown = " ;".join(comments) if comments else None
                    entries[-1] = replace(above, numbers=(*above.numbers, *numbers), comment=shown)
                    goes_on = len(entries[-1].numbers) < AXES
                    continue
                entry = self._parser.entry(inner.text, inner.number)
            except LineRefused as refused:
                self.diagnostics.append(refused.diagnostic)
                goes_on = False
                continue
            goes_on = isinstance(entry, Entry) and line.directive == ".LOCATIONS" and not entry.variable.sigil
            if isinstance(entry, Entry):
                entries.append(entry)
            else:
                remarks.append((len(entries), entry))
        fitting = tuple(entry for entry in entries if self._fits(entry, line.directive))
        return Section(line.directive, fitting, tuple(remarks), len(self.diagnostics) == before, span=line.span)

    def _fits(self, entry: Entry, section: str) -> bool:
        """Return whether an entry has the kind of value of its section, constant indexes, and the right count of
        numbers. Report what is wrong."""
        name, wrong = entry.variable.sigil + entry.variable.name, ""
        indexes = entry.variable.indexes or ()
        if entry.variable.indexes == () or not all(isinstance(index, ast.Number) for index in indexes):
            wrong = "an index in a file is a number"
        elif section == ".STRINGS" and (entry.variable.sigil != "$" or entry.text is None):
            wrong = 'a string is written $name "text"'
        elif section in (".REALS", ".DOUBLES") and (entry.variable.sigil or len(entry.numbers) != 1):
            wrong = "a real is written name 12.5"
        elif section == ".LOCATIONS" and not (
            1 <= len(entry.numbers) <= JOINTS_HIGH
            if entry.variable.sigil == "#"
            else not entry.variable.sigil and len(entry.numbers) in (ANGLES, AXES)
        ):
            name += f": {count(len(entry.numbers), 'number')}"
            wrong = "a location is written name x y z o a t, or with 12 numbers; a precision point #name and its joints"
        if wrong:
            self.fault(TypeMismatch, entry.span, name, wrong)
        return not wrong


def _body(lines: Sequence[SourceLine]) -> Sequence[SourceLine]:
    """Return the lines before the first `.END` or heading of a section."""
    ends = (i for i, line in enumerate(lines) if line.directive == END or line.directive in SECTIONS)
    return lines[: next(ends, len(lines))]


def program_name(file: str) -> str:
    """Convert the name of a file to a valid program name, for a program without a heading."""
    name = re.sub(r"[^A-Za-z0-9._]+", ".", file).strip(".")
    return (name if name[:1].isalpha() else f"p.{name}")[:NAME_LENGTH].rstrip(".")


def repeated_programs(programs: Iterable[tuple[Program, int]]) -> Iterator[Diagnostic]:
    """Yield an error for each program that has the name of an earlier program of the file. `programs`: pairs of a
    program and the number of lines above its part (spans count lines from the start of the part)."""
    names: set[str] = set()
    for program, above in programs:
        if program.key in names:
            yield duplicate_name(program, above, "is there twice in this file")
        names.add(program.key)


def duplicate_name(program: Program, above: int, how: str) -> Diagnostic:
    """Return the error for a program that has the name of another program. `above`: the number of lines in the file
    above the program's part; `how`: the text that follows the name in the message."""
    return error(ProgramExists, replace(program.span, line=program.span.line + above), f"{program.name} {how}")


def step_numbers(lines: Sequence[SourceLine]) -> bool:
    """Return whether all lines of a program begin with the step numbers of a listing: 1, 2, 3, ...

    The numbers may also look as in the editor and in books: `1.`, `1.?`. If a GOTO, a THEN or a GRASP of the program
    refers to one of the numbers, they are labels instead, and the result is False.
    """
    rest: list[str] = []
    for line in lines:
        if line.text and not line.text.isspace():
            match = _STEP_NUMBER.match(line.text)
            if match is None or int(match[1][:9]) != len(rest) + 1:
                return False
            rest.append(line.text[match.end() :])
    labels = {inner[1] for text in rest if (inner := re.match(r"[ \t]*([0-9]+)(?![\w.])[ \t]*", text))}
    targets = {
        target for text in rest for target in re.findall(r"(?i)\b(?:GOTO|THEN|GRASP\b[^;]*,)[ \t]*([0-9]+)", text)
    }
    return len(rest) > 1 and targets <= labels


# compiled on first use, because few files have such comments
_COMMENT: Final = r"(?i);.*\bvrs:\s*ignore(-file)?((?:[\s,]+V\d{3,4})*)\s*$"


def drop_suppressed(lines: Sequence[str], found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return the diagnostics without the warnings that `; vrs: ignore` comments suppress. `lines`: the lines of the
    file."""
    everything = tuple(found)
    asked = [(number, line) for number, line in enumerate(lines, 1) if "vrs:" in line and len(line) <= MAX_LINE_CHARS]
    if not asked or not everything:
        return everything
    unwanted: dict[int, set[str]] = {}  # suppressed codes ("" for all) by line number; 0 is the whole file
    for number, line in asked:
        if comment := re.search(_COMMENT, line):
            unwanted.setdefault(0 if comment[1] else number, set()).update(
                re.findall(r"V\d{3,4}", comment[2].upper()) or [""]
            )
    everywhere = unwanted.get(0, set())
    return tuple(
        one
        for one in everything
        if one.severity is not Severity.WARNING
        or (everywhere | unwanted.get(one.span.line, set())).isdisjoint(("", one.label))
    )


WAY = "MOVE, MOVES, APPRO, WAIT SIG(n), SIGNAL and TYPE do it in VAL-II; a program begins with .PROGRAM name"


class Maker(Struct, frozen=True):
    """The language of another robot maker. `sure`: a pattern of lines that never occur in VAL-II; `likely`: a pattern
    of lines that are frequent in this language, but may occur in VAL-II."""

    title: str
    sure: str
    likely: str


_MAKERS: tuple[Maker, ...] = (
    Maker(
        "Kawasaki AS",
        r"\.(?:TRANS|JOINTS|INTER_PANEL_D|INTER_PANEL_TITLE|NETCONF)\b",
        r"(?:JMOVE(?![^;\n]*,[^;\n]*,)|LMOVE|HMOVE|XMOVE|JAPPRO|LAPPRO|JDEPART|LDEPART|TWAIT|SWAIT|C1MOVE|C2MOVE)\b",
    ),
    Maker(
        "KRL (KUKA)",
        r"&(?:ACCESS|REL|PARAM|COMMENT)\b|;FOLD\b|BAS[ \t]*\([ \t]*#"
        r"|(?:GLOBAL[ \t]+)?DEF(?:FCT|DAT)?[ \t]+\w+[ \t]*\([^)]*\)[ \t]*$",
        r"(?:PTP|LIN|CIRC|SLIN|SPTP)[ \t]+(?:\{|X?\w+|\$)|ENDFOLD|DECL[ \t]+\w+|\$(?:VEL|ACC|BASE|TOOL|OUT)\b",
    ),
    Maker(
        "RAPID (ABB)",
        r"MODULE[ \t]+\w+(?:[ \t]*\(.*\))?[ \t]*$|PROC[ \t]+\w+[ \t]*\("
        r"|(?:PERS|VAR|CONST|LOCAL PERS)[ \t]+(?:robtarget|jointtarget|tooldata|wobjdata|num|bool|speeddata)\b",
        r"Move(?:J|L|C|AbsJ)[ \t]+|ENDPROC|ENDMODULE|(?:Set|Reset)[ \t]+\w+[ \t]*;|WaitTime[ \t]|TPWrite[ \t]",
    ),
    Maker(
        "URScript (Universal Robots)",
        r"(?:movej|movel|movep|movec|servoj|speedl)[ \t]*\(|set_(?:digital|standard_digital|tool_digital)_out[ \t]*\(",
        r"def[ \t]+\w+[ \t]*\(.*\)[ \t]*:[ \t]*$|textmsg[ \t]*\(|sleep[ \t]*\(|set_tcp[ \t]*\(",
    ),
    Maker(
        "Karel, or a teach pendant program (FANUC)",
        r"/(?:PROG|MN|POS|ATTR|APPL)\b|[ \t]*\d*:[ \t]*[JLC][ \t]+P[ \t]*R?\[",
        r"PROGRAM[ \t]+\w+[ \t]*$|BEGIN[ \t]*$|END[ \t]+\w+[ \t]*$|ROUTINE[ \t]+\w+|--"
        r"|%(?:NOLOCKGROUP|COMMENT|ENVIRONMENT)",
    ),
)
_WORD = "[A-Z][A-Z0-9_]+"
_KAWASAKI = (*(f".{word}" for word in re.findall(_WORD, _MAKERS[0].sure)), *re.findall(_WORD, _MAKERS[0].likely))
MIN_LIKELY_LINES, MIN_LIKELY_PART = (
    2,
    0.1,
)  # without a sure line, a file is foreign only with this many likely lines, and if they are this fraction of its steps
# matches lines that are not steps: blank lines, comments, headings, and values of variables
_NO_STEP = r"(?im)^[ \t]*(?:;.*|\.[A-Z].*|#?[A-Z][\w.]*(?:\[[\d, ]*\])?(?:[ \t]+[-+.\d][\d.E+-]*)+[ \t]*)?\r?$"
# matches motion instructions that only VAL-II has
_OURS = r"(?im)^[ \t]*(?:\d+[ \t]+)?(?:MOVES?T?|APPROS?|DEPARTS?)[ \t]+(?!TO\b)[#\w]"


def foreign_file(text: str) -> Diagnostic | None:
    """Return an error at the first line typical of another robot manufacturer's language, if a file is in that
    language; None if the file may be VAL-II."""
    makers = _MAKERS
    # of the other languages, only Kawasaki's has .PROGRAM; the quick search for its words avoids slow patterns
    if has_program(text):
        capitals = text.upper()
        makers = _MAKERS[:1] if any(word in capitals for word in _KAWASAKI) else ()
    for maker in makers:
        sure, likely = (re.compile(rf"(?im)^[ \t]*(?:\d+[ \t]+)?({one})") for one in (maker.sure, maker.likely))
        found = [match.start(1) for match in likely.finditer(text)]
        proof = [match.start(1) for match in sure.finditer(text)]
        if (proof or len(found) >= MIN_LIKELY_LINES) and _prevails(text, len(found), len(proof)):
            begin = min(found + proof)
            line_begin, end = text.rfind("\n", 0, begin) + 1, text.find("\n", begin)
            line = text[begin : len(text) if end < 0 else end].rstrip()
            column = begin - line_begin + 1
            span = Span(text.count("\n", 0, begin) + 1, column, column + max(len(line), 1))
            return error(CannotInterpret, span, f"this file is in {maker.title}, not in VAL-II", WAY)
    return None


def has_program(text: str) -> bool:
    """Return whether a file contains a program that begins with .PROGRAM."""
    return re.search(r"(?im)^[ \t]*\.PROGRAM\b", text) is not None


def _prevails(text: str, likely: int, sure: int) -> bool:
    """Return whether enough lines of a file are in another language: at least as many as there are VAL-II motions, and
    unless some are `sure`, at least MIN_LIKELY_PART of all steps. `likely`, `sure`: how many lines are probably, or
    certainly, in the other language (see Maker)."""
    if len(re.findall(_OURS, text)) > likely + sure:
        return False
    steps = text.count("\n") + 1 - len(re.findall(_NO_STEP, text))
    return sure > 0 or likely >= MIN_LIKELY_PART * steps


def parse_file(
    text: str, dialect: Dialect = Dialect.VPLUS, *, name: str = "", whole: bool = True, remembered: bool = True
) -> tuple[ast.File, tuple[Diagnostic, ...]]:
    """Return the programs and sections of a file, and all mistakes in it.

    A bad line of a program is kept as a BadLine. Lines may end with LF, CR LF or CR. `dialect`: the dialect to use if
    the file does not name one. `name`: the name of the file, from which a program without a heading gets its name.
    `whole`: the text is a complete file; if it is in another manufacturer's language, report that as an error, and
    parse the text only if it contains a .PROGRAM line. `remembered`: keep the parsed steps in the parser's cache, for a
    file that is parsed again after changes.
    """
    foreign = foreign_file(text) if whole else None
    if foreign is not None and not has_program(text):
        return ast.File(()), (foreign,)
    own, wrong = dialect_in(text, dialect)
    file, found = FileReader(_parser(own), own, remembered=remembered).read(text, name)
    told = () if foreign is None else (foreign,)
    return file, (*told, *wrong, *found)


def parse_step(text: str, line: int = 1, dialect: Dialect = Dialect.VPLUS) -> Step:
    """Parse a program line with its optional label, statement and comment. Raises LineRefused."""
    return _parser(dialect).step(text, line)


def parse_prompt(
    text: str, names: Container[str] = (), dialect: Dialect = Dialect.VPLUS
) -> Statement | ProgramHeader | None:
    """Parse a line typed at the prompt; return None for a blank line or a comment. `names`: the keys of variables that
    have a value. Raises LineRefused.

    A monitor command becomes an Instruction, an expression alone a Show, any other statement a DoInstruction.
    """
    at, parser = header_end(text), _parser(dialect)
    return parser.prompt(text, names) if at is None else parser.header(text, 1, at)


def variables_in(lines: Iterable[str]) -> set[str]:
    """Return the keys of the variables that the lines of a program assign or declare and that have the name of a
    function."""
    parameters: list[ast.Variable] = []
    statements: list[Statement | None] = []
    for line in lines:
        if re.search(_NAME_OF_FUNCTION, line):
            with suppress(LineRefused):
                header = parse_prompt(line) if header_end(line) is not None else None
                parameters += header.parameters if isinstance(header, ProgramHeader) else ()
                statements.append(parse_step(line).statement)
    return variables_named_like_functions(parameters, statements)


_NAME_OF_FUNCTION = "(?i)" + "|".join(map(re.escape, FUNCTION_NAMES))


@cache
def _parser(dialect: Dialect) -> LineParser:
    """Return the parser for a dialect. Operator precedence differs between V+ on the one hand, VAL-II and VAL on the
    other."""
    if dialect is Dialect.VAL:
        return _parser(Dialect.VAL2)
    return LineParser(None if dialect is Dialect.VPLUS else ValBuilder())


# --- the parts of a file -----------------------------------------------------------------------------------------


class Part(Struct, frozen=True, eq=False, dict=True):
    """A part of a file: a program or a section with all lines up to the next heading, or the lines before the first
    heading.

    An edit changes few parts of a file; the others are not parsed again. Spans in a part count lines from the start of
    the part, so that lines inserted or deleted above do not change it. `last`: the line number of its `.END`, or else
    of its last line. `name`: the name of the file, if the part may be a program without a heading; otherwise "".
    """

    lines: tuple[str, ...]
    last: int
    dialect: Dialect
    name: str = ""

    @cached_property
    def _read(self) -> tuple[File, tuple[Diagnostic, ...]]:
        # end with a line end, so that a final Ctrl-Z is reported, not removed as the mark of the end of a file
        text = "\n".join((*self.lines, ""))
        return parse_file(text, self.dialect, name=self.name, whole=False)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        return self._read[1]

    @cached_property
    def node(self) -> Program | Section | None:
        """Return the program or section of the part; None if there is none, or its heading cannot be parsed."""
        return next((part for part in self._read[0].parts if isinstance(part, Program | Section)), None)


class Placed(Struct, frozen=True):
    """A part with its position in a file. `above`: the number of lines before it."""

    part: Part
    above: int

    def span(self, span: Span) -> Span:
        """Convert a span of the part to a span of the file."""
        return Span(span.line + self.above, span.column, span.end)

    def translate(self, diagnostics: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
        """Convert diagnostics of the part to diagnostics of the file."""
        return (replace(one, span=self.span(one.span)) for one in diagnostics)


Known = Mapping[tuple[str, ...], Part]


def parts_of(text: str, known: Known, dialect: Dialect = Dialect.VPLUS, name: str = "") -> tuple[Placed, ...]:
    """Cut a file into its parts. `known`: earlier parts by their lines; a part with the same lines is reused.
    `dialect`: the dialect to use if the file does not name one. `name`: the name of the file, for a program without a
    heading."""
    placed, above = list[Placed](), 0
    own, _ = dialect_in(text, dialect)
    bare = "" if has_program(text) else name
    for lines in cut(lines_of(text)):
        texts, end = tuple(line.text for line in lines), end_of(lines)
        if (part := known.get(texts)) is None or part.dialect is not own:
            part = Part(texts, len(lines) if end is None else end + 1, own, "" if above else bare)
        placed.append(Placed(part, above))
        above += len(lines)
    return tuple(placed)


def programs_of(parts: Iterable[Placed]) -> Iterator[tuple[Placed, Program]]:
    """Yield each part that is a program, together with the program."""
    return ((placed, placed.part.node) for placed in parts if isinstance(placed.part.node, Program))
