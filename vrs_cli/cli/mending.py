"""`vrs check --fix`: what can surely be mended is written into the file, all of it or nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from vrs_cli.cli.findings import Finding
from vrs_cli.cli.sources import Source
from vrs_cli.files.atomic import write_atomically
from vrs_cli.values.diagnostics import Diagnostic, ordered

ROUNDS = 10  # of mends that uncover others

Find = Callable[[str], tuple[Diagnostic, ...]]


def mended(finding: Finding, find: Find) -> Finding:
    """What is left after mending; one mend may uncover another. Raises FileError."""
    now = finding
    for _ in range(ROUNDS):
        mends = tuple(_apart(now.diagnostics))
        text = _written(now.source.text, mends)
        now = Finding(Source(now.source.path, text), find(text), now.mended + len(mends)) if mends else now
    if now.mended:
        write_atomically(now.source.path, now.source.text)
    return now


def _apart(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The mends of which none stands in another: of two such the one that begins first."""
    line, end = 0, 0
    for one in found:
        span = one.span
        if one.mend and (span.line, span.column) >= (line, end):
            yield one
            line, end = span.line, span.end


def _written(text: str, mends: Iterable[Diagnostic]) -> str:
    lines = text.split("\n")
    for one in reversed(ordered(mends)):
        line, span = lines[one.span.line - 1], one.span
        lines[span.line - 1] = f"{line[: span.column - 1]}{one.mend}{line[span.end - 1 :]}"
    return "\n".join(lines)
