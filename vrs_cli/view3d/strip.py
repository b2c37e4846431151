"""The timeline as a strip: what each stretch of it is, by colour, its commands, and what is in doubt. SVG; pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from math import ceil, floor, inf, log10
from typing import NamedTuple

from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.trajectory.segment import Phase, Segment
from vrs_cli.trajectory.timeline import Timeline

UNCONFIRMED, FLAGGED = (246, 204, 20), (210, 69, 60)  # RGB


class Doubts(NamedTuple):
    """From `unconfirmed` on [s] it is not what the robot has said; something wrong was shown of the times `flagged`;
    `refused`: when commands were issued that the robot will not do [s], and their texts.
    """

    unconfirmed: float = inf
    flagged: tuple[tuple[float, float], ...] = ()
    refused: tuple[tuple[float, str], ...] = ()

    @classmethod
    def of(cls, seen: Previewed | None) -> Doubts:
        if seen is None:
            return NO_DOUBTS
        refused = tuple((one.issued, one.text) for one in seen.expected if one.refused is not None)
        return cls(seen.unconfirmed, seen.flagged, refused)


NO_DOUBTS = Doubts()


COLOURS: Mapping[Phase, str] = {
    Phase.ACCELERATE: "#2f9e8f",
    Phase.CRUISE: "#3d7dca",
    Phase.BLEND: "#8a63c9",
    Phase.DECELERATE: "#e08a2e",
    Phase.REST: "#c9cdd2",
}
GAP, MARK = "#eef0f2", "#5f6670"
HEIGHT, TEXT = 14, 11  # [px] of the stretches, and of letters
LETTER = 6.2  # [px] that one takes
LEAST_TEXT = 4  # letters of a command that are worth to be read
LEAST = 0.4  # [px] of a stretch, and between two marks, that can be seen
SEEN = 3.0  # [px] of flagged times
SHORTEST = 1.0  # [s] of what is spanned
STEPS = (1.0, 2.0, 5.0, 10.0)  # that a span grows by, times a power of ten
MARKS = 20  # of these in a span, about


class TimeSpan(NamedTuple):
    """The times that are shown [s]."""

    low: float
    high: float

    @classmethod
    def over(cls, low: float, high: float) -> TimeSpan:
        """A span between round times, so that a timeline that grows is not drawn again all the time."""
        high = max(high, low + SHORTEST)
        length = high - low
        power = 10.0 ** floor(log10(length / MARKS))
        step = power * next(one for one in STEPS if one * power * MARKS >= length)
        begin = floor(low / step) * step
        return cls(begin, ceil((high - 1e-9) / step) * step)

    def within(self, t: float) -> float:
        return min(max(t, self.low), self.high)

    def percent(self, t: float) -> float:
        return 100.0 * (self.within(t) - self.low) / (self.high - self.low)


def strip(timeline: Timeline, span: TimeSpan, width: float, doubts: Doubts = NO_DOUBTS) -> str:
    """The picture, which is about so many pixels wide. What is in doubt is hatched."""
    segments = tuple(segments_in(timeline, span))
    parts = [*_stretches(segments, span, width), *_commands(segments, span, width), *_doubts(doubts, span, width)]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="100%" height="{HEIGHT + TEXT + 6}" style="display:block" '
        f'font-family="sans-serif" font-size="{TEXT}" fill="{MARK}">{HATCHES}{_box(0.0, 100.0, GAP)}'
        f"{''.join(parts)}</svg>"
    )


def _hatch(name: str, colour: tuple[int, int, int], degrees: int) -> str:
    return (
        f'<pattern id="{name}" width="6" height="6" patternUnits="userSpaceOnUse" '
        f'patternTransform="rotate({degrees})"><path d="M0 0V6" stroke="rgb{colour}" stroke-width="4"/></pattern>'
    )


HATCHES = _hatch("unconfirmed", UNCONFIRMED, 45) + _hatch("flagged", FLAGGED, -45)


def _doubts(doubts: Doubts, span: TimeSpan, width: float) -> Iterator[str]:
    """Flagged times have some width, however short they are."""
    least = 100.0 * SEEN / width
    if doubts.unconfirmed < span.high:
        yield _box(span.percent(doubts.unconfirmed), 100.0, "url(#unconfirmed)")
    for begin, end in doubts.flagged:
        if begin < span.high and end > span.low:
            at = span.percent(begin)
            yield _box(at, max(span.percent(end), at + least), "url(#flagged)")
    for t, text in doubts.refused:
        if span.low <= t < span.high:
            at, red = span.percent(t), f'fill="rgb{FLAGGED}"'
            yield f'<rect x="{at:.3f}%" width="2" height="{HEIGHT + 4}" {red}><title>{escape(text)}</title></rect>'


def segments_in(timeline: Timeline, span: TimeSpan) -> Iterator[Segment]:
    """The segments that lie at least partly in a span, in order."""
    for index in range(timeline.index_at(span.low), len(timeline)):
        segment = timeline[index]
        if segment.start >= span.high:
            return
        yield segment


def _stretches(segments: tuple[Segment, ...], span: TimeSpan, width: float) -> Iterator[str]:
    drawn, least = -1.0, 100.0 * LEAST / width
    for segment in segments:
        begin, end = span.percent(segment.start), span.percent(segment.finish)
        if end > max(begin, drawn + least):
            yield _box(max(begin, drawn), end, COLOURS[segment.phase])
            drawn = end


def _commands(segments: tuple[Segment, ...], span: TimeSpan, width: float) -> Iterator[str]:
    """A mark where each begins, and its text as far as there is room."""
    begins = [
        (span.percent(segment.start), segment.motion.text)
        for before, segment in zip((None, *segments), segments, strict=False)
        if segment.motion.text and (before is None or before.motion.number != segment.motion.number)
    ]
    last, least = -1.0, 100.0 * LEAST / width
    for i, (at, text) in enumerate(begins):
        if at < last + least:
            continue
        last = at
        yield f'<rect x="{at:.3f}%" width="1" height="{HEIGHT + 4}"/>'
        after = begins[i + 1][0] if i + 1 < len(begins) else 100.0
        room = int((after - at) * width / 100.0 / LETTER) - 1
        if room >= min(LEAST_TEXT, len(text)):
            shown = text if len(text) <= room else text[: room - 1] + "…"
            yield f'<text x="{at:.3f}%" dx="3" y="{HEIGHT + TEXT + 2}">{escape(shown)}</text>'


def _box(begin: float, end: float, fill: str) -> str:
    return f'<rect x="{begin:.3f}%" width="{end - begin:.3f}%" height="{HEIGHT}" fill="{fill}"/>'
