"""The bar of time: play, pause, seek, faster, slower, over and over, from command to command; under its slider the
timeline as a strip of SVG, which shows each stretch by colour, the commands, and what is in doubt.

And curves over what the bar spans: joints, their speed against its limits, the speed of the tool. A plot that is not
open costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from html import escape
from itertools import cycle
from math import ceil, floor, inf, log10
from threading import Lock
from typing import Any, Literal, NamedTuple

import numpy as np
import viser
from viser import uplot

from vrs_cli.engine.position import positions_at
from vrs_cli.interfaces.port.preview import Previewed
from vrs_cli.interfaces.roles.playback import Playback, command_after, command_before
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.render.colours import COLOURS, CURVES
from vrs_cli.trajectory.segment import Phase, Segment
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.parts import Redrawing, Shown, put
from vrs_cli.view3d.window import RobotWindow

UNCONFIRMED, FLAGGED = (246, 204, 20), (210, 69, 60)  # RGB


class Doubts(NamedTuple):
    """Times in doubt: from `unconfirmed` on [s] the timeline is not what the robot has said; something wrong was shown
    of the times `flagged`; `refused`: when commands were issued that the robot will not do [s], and their texts.
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


PHASE_COLOURS: Mapping[Phase, str] = {
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
            yield _box(max(begin, drawn), end, PHASE_COLOURS[segment.phase])
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


# --- the bar ---------------------------------------------------------------------------------------------------------


STANDS = 0.5  # [s] between two times that are told of a robot that stands, while it is followed
HANDS_OFF = 0.4  # [s] after the user moved the slider in which it is left alone
SKIP = 10.0  # [s]
FINEST = 0.001  # [s] of the slider
MARGINS = "margin:0 calc(3rem + 1.25rem) 0 calc(7.25em + 0.625rem)"  # of viser's slider, in which its track is
BESIDE, NARROWEST = 230.0, 100.0  # [px] of a picture that are beside the track, and of a track at least

Hotkey = Literal["space", "home", "end", "pageup", "pagedown", "F", "N", "B", "L", "Z", "X"]


class Action(NamedTuple):
    """An action of the bar: on a button, if it has one, and by a key. `live`: only where a robot is watched."""

    label: str
    key: Hotkey
    button: str
    change: Callable[[Playback, float, Timeline], Playback]
    live: bool = False


def _stop_at(playback: Playback, t: float, wall: float) -> Playback:
    return playback.seek(t, wall).pause(wall)


ACTIONS: tuple[Action, ...] = (
    Action("To the start", "home", "|◀", lambda p, wall, _: p.rewind(wall)),
    Action("Back a command", "B", "◀ command", lambda p, wall, tau: _stop_at(p, command_before(tau, p.at(wall)), wall)),
    Action("Play or pause", "space", "play / pause", lambda p, wall, _: p.toggle(wall)),
    Action("On a command", "N", "command ▶", lambda p, wall, tau: _stop_at(p, command_after(tau, p.at(wall)), wall)),
    Action("To the end", "end", "▶|", lambda p, wall, _: p.seek(p.end, wall)),
    Action("Follow the robot", "F", "live", lambda p, wall, _: p.follow(wall), live=True),
    Action("Slower", "Z", "slower", lambda p, wall, _: p.slower(wall)),
    Action("Faster", "X", "faster", lambda p, wall, _: p.faster(wall)),
    Action("Over and over", "L", "loop", lambda p, wall, _: p.loop(wall)),
    Action(f"Back {SKIP:g} s", "pageup", "", lambda p, wall, _: p.skip(-SKIP, wall)),
    Action(f"On {SKIP:g} s", "pagedown", "", lambda p, wall, _: p.skip(SKIP, wall)),
)
ZOOM = "zoom"
LINE = (
    "padding:0 0.625rem;height:1.5rem;font-size:0.8rem;font-variant-numeric:tabular-nums;white-space:nowrap;"
    "overflow:hidden;text-overflow:ellipsis"
)
LEGEND = (
    '<span style="float:right">'
    + "".join(
        f'<span style="color:{colour}">&nbsp; &#9632;</span> {phase.value}' for phase, colour in PHASE_COLOURS.items()
    )
    + "</span>"
)
RANGES = (inf, 60.0, 20.0, 5.0)  # [s] of the timeline that are under the slider, one after the other


class PlaybackBar:
    """The controls in the container of the page that is open, and the keys. `span`: what is under the slider."""

    def __init__(self, window: RobotWindow) -> None:
        self._window, gui = window, window.client.gui
        actions = [action for action in ACTIONS if window.robot is not None or not action.live]
        self._actions = {action.button: action for action in actions}
        buttons = gui.add_button_group("", (*(button for button in self._actions if button), ZOOM))
        buttons.on_click(window.doing_with(lambda event: self._press(event.target.value)))
        self._slider = gui.add_slider("t [s]", 0.0, 1.0, FINEST, 0.0)
        self._slider.on_update(self._slide)
        self._strip, self._cursor = gui.add_html(""), gui.add_html("")
        for action in actions:
            gui.add_command(action.label, hotkey=action.key).on_trigger(window.doing(partial(self._do, action)))
        gui.add_command("Show more or less of the timeline", hotkey="V").on_trigger(window.doing(self._zoom))
        self.span, self._length = TimeSpan(0.0, 1.0), inf
        self._drawing = Redrawing(window.wall)
        self._told_at = self._moved_at = -inf
        self._stood = False

    # --- what the user does ---

    def _press(self, button: str) -> None:
        if button == ZOOM:
            self._zoom()
        else:
            self._do(self._actions[button])

    def _zoom(self) -> None:
        self._length = RANGES[(RANGES.index(self._length) + 1) % len(RANGES)]

    def _do(self, action: Action) -> None:
        timeline = self._window.watched.timeline
        self._window.change(lambda playback, wall: action.change(playback, wall, timeline))

    async def _slide(self, event: viser.GuiEvent[Any]) -> None:
        """The user has moved the slider. Read at once: it follows time."""
        t = float(event.target.value)
        self._moved_at = self._window.wall()
        self._window.doing(lambda: self._window.change(lambda playback, wall: playback.seek(t, wall)))(event)

    # --- what the user sees ---

    def show(self, shown: Shown) -> None:
        wall, playback = self._window.wall(), self._window.playback
        span = self._span_of(playback, shown.t)
        timeline, doubts = shown.timeline, Doubts.of(shown.seen)
        draw = partial(self._draw, timeline, span, doubts)
        self._drawing.look((timeline.version, id(timeline), doubts), (span, self._window.width), draw)
        if not shown.reads:
            return
        stands = playback.follows and playback.playing and not shown.position.moving
        if stands and self._stood and wall < self._told_at + STANDS:
            return  # only the clock of the robot goes on: the time is written less often
        self._stood, self._told_at = stands, wall
        if wall > self._moved_at + HANDS_OFF:
            put(self._slider, value=round(self.span.within(shown.t), 3))
        put(self._cursor, content=_cursor(self.span, shown) + _told(shown, playback, wall))

    def _span_of(self, playback: Playback, t: float) -> TimeSpan:
        """Return the span of all of it, or of the page of it in which t is, between round times."""
        if self._length == inf:
            return TimeSpan.over(playback.start, playback.end)
        low = floor(t / self._length) * self._length
        return TimeSpan(low, low + self._length)

    def _draw(self, timeline: Timeline, span: TimeSpan, doubts: Doubts) -> None:
        if span != self.span:
            self.span = span
            self._slider.min, self._slider.max = span
        picture = strip(timeline, span, max(self._window.width - BESIDE, NARROWEST), doubts)
        self._strip.content = f'<div style="{MARGINS}">{picture}</div>'


def _cursor(span: TimeSpan, shown: Shown) -> str:
    """A line at the time that is shown, over the strip, which stands before it."""
    line = "position:absolute;top:-33px;height:20px;width:2px;margin-left:-1px"
    at, now = span.percent(shown.t), span.percent(shown.now)
    there = f'<div style="{line};left:{at:.2f}%;background:#d2453c"></div>'
    present = f'<div style="{line};left:{now:.2f}%;background:#2b2f33;opacity:.35"></div>'
    return f'<div style="{MARGINS}"><div style="position:relative;height:0">{present}{there}</div></div>'


def _told(shown: Shown, playback: Playback, wall: float) -> str:
    """Say the time, what is played, and what the robot does then."""
    loop = ", over and over" if playback.loops else ""
    doing = f"{playback.doing(wall)}, {playback.rate:g} x{loop}"
    text = shown.position.text if shown.position.moving else "at rest"
    return (
        f'<div style="{LINE}"><b>{shown.t:.2f} s</b> of {playback.end:.2f} s '
        f'<span style="opacity:.65">{doing}</span> &nbsp; {escape(text)}{LEGEND}</div>'
    )


# --- curves ----------------------------------------------------------------------------------------------------------


SAMPLES = 600  # of a curve: more than there are pixels
WIDTH, TALL = 380.0, 150  # [px] of the panel, and of a plot
ABOVE, RIGHT, BELOW, LEFT = 8, 14, 26, 52  # [px] beside the curves
MARGIN = "0.625rem"  # of viser's plots, left and right
HUES = tuple(COLOURS[ink][0] for ink in CURVES)
LEGEND_STYLE = f"padding:2px {MARGIN} 6px;font-size:0.75rem;font-variant-numeric:tabular-nums"
STEP = 1e-4  # [s] over which the speed of the tool is measured


class PlotKind(NamedTuple):
    """A plot: how its box and its curves are called, and their values (N, curves) in the unit that people read."""

    box: str
    title: str
    names: Callable[[RobotArm], Sequence[str]]
    values: Callable[[RobotArm, Timeline, Floats], Floats]
    range: tuple[float, float] | None = None


def _joint_names(arm: RobotArm) -> list[str]:
    return [f"JT{joint}" for joint in range(1, arm.model.joint_count + 1)]


def _joints(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    units = arm.model.units
    scales = np.array([units.one_shown(joint, 1.0) for joint in range(1, arm.model.joint_count + 1)])
    joints: Floats = positions_at(arm, timeline, times).joints * scales
    return joints


def _shares(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    """The speeds of the joints in per cent of their limits."""
    shares: Floats = 100.0 * positions_at(arm, timeline, times).velocity / np.array(arm.model.max_velocity)
    return shares


def _tool_speed(arm: RobotArm, timeline: Timeline, times: Floats) -> Floats:
    before, after = (positions_at(arm, timeline, times + s).T_world_tool[:, :, 3] for s in (-STEP, STEP))
    speed: Floats = 1000.0 * np.linalg.norm(after - before, axis=1)[:, None] / (2.0 * STEP)
    return speed


KINDS: tuple[PlotKind, ...] = (
    PlotKind("joints", "Joints [deg, mm]", _joint_names, _joints),
    PlotKind("joint speeds", "Joint speeds [% of limit]", _joint_names, _shares, (-105.0, 105.0)),
    PlotKind("tool speed", "Tool speed [mm/s]", lambda _arm: ["tool"], _tool_speed),
)


class Plots:
    """Boxes in the container of the page that is open, and a panel with what they choose, of what the bar spans."""

    def __init__(self, window: RobotWindow, bar: PlaybackBar) -> None:
        self._window, self._bar, gui = window, bar, window.client.gui
        self._panel: viser.PanelHandle | None = None
        self._open: dict[PlotKind, _Plot] = {}
        self._lock = Lock()
        for kind in KINDS:
            box = gui.add_checkbox(kind.box, initial_value=False)
            box.on_update(window.doing_with(partial(self._choose, kind)))

    def _choose(self, kind: PlotKind, event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        with self._lock:
            if event.target.value and kind not in self._open:
                if self._panel is None:  # on the right, opened with the first plot
                    self._panel = self._window.client.gui.add_panel()
                    self._tab = self._panel.add_tab("Plots")
                    self._panel.dock_right()
                    self._panel.set_width(WIDTH)
                with self._tab:
                    self._open[kind] = _Plot(kind, self._window)
            elif not event.target.value and kind in self._open:
                self._open.pop(kind).remove()
                if not self._open and self._panel is not None:
                    self._panel.remove()
                    self._panel = None

    def show(self, shown: Shown) -> None:
        if self._open:
            with self._lock:
                for plot in self._open.values():
                    plot.show(shown, self._bar.span)


class _Plot:
    """One plot in the container that is open, with a line at the time that is shown."""

    def __init__(self, kind: PlotKind, window: RobotWindow) -> None:
        self._kind, self._arm = kind, window.watched.arm
        gui, arm = window.client.gui, self._arm
        names = kind.names(arm)
        curves = zip(names, cycle(HUES), strict=False)
        scale = {"y": uplot.Scale(range=kind.range)} if kind.range else {}
        self._plot = gui.add_uplot(
            tuple(np.zeros(2) for _ in range(len(names) + 1)),
            (
                uplot.Series(label="s"),
                *(uplot.Series(label=name, stroke=hue, width=1.5) for name, hue in curves),
            ),
            scales={"x": uplot.Scale(time=False), **scale},
            axes=(uplot.Axis(size=BELOW), uplot.Axis(size=LEFT)),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(show=False),
            height=TALL,
            padding=(ABOVE, RIGHT, 0, 0),
        )
        self._follows = gui.add_html("")
        self._drawing = Redrawing(window.wall)

    def show(self, shown: Shown, span: TimeSpan) -> None:
        timeline = shown.timeline
        self._drawing.look((timeline.version, id(timeline)), span, lambda: self._draw(timeline, span))
        if shown.reads:
            put(self._follows, content=_line(span.percent(shown.t)) + self._legend(timeline, shown.t))

    def _draw(self, timeline: Timeline, span: TimeSpan) -> None:
        times = np.linspace(span.low, span.high, SAMPLES)
        self._plot.data = (times, *np.ascontiguousarray(self._kind.values(self._arm, timeline, times).T))

    def _legend(self, timeline: Timeline, t: float) -> str:
        """The title, the names of the curves, and their values at t."""
        values = self._kind.values(self._arm, timeline, np.array([t]))[0]
        told = (
            f'<span style="color:{colour}">{name} {value:.1f}</span>'
            for name, colour, value in zip(self._kind.names(self._arm), cycle(HUES), values.tolist(), strict=False)
        )
        return f'<div style="{LEGEND_STYLE}"><b>{self._kind.title}</b><br>{" &nbsp; ".join(told)}</div>'

    def remove(self) -> None:
        self._plot.remove()
        self._follows.remove()


def _line(percent: float) -> str:
    """At the time that is shown, over the curves, which stand before it."""
    part = percent / 100.0
    place = f"left:calc({LEFT}px + (100% - {LEFT + RIGHT}px) * {part:.4f});top:-{TALL + ABOVE}px"
    line = f"position:absolute;{place};height:{TALL - BELOW}px;width:1px;background:#d2453c"
    return f'<div style="margin:0 {MARGIN};position:relative;height:0"><div style="{line}"></div></div>'
