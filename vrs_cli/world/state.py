"""The state of a world at one time, between its history and the value that goes to others."""

from __future__ import annotations

from vrs_cli.values.world import CertainHappening, DueHappening, PartLands, SpanKind, WorldState
from vrs_cli.world.grasp import add_grip
from vrs_cli.world.history import CHANGES, SEES, WorldHistory
from vrs_cli.world.settings import WorldSettings
from vrs_cli.world.support import lift, put

ALONE = ("hand", "held", "width", "stack")  # values that both call the same


def state_at(history: WorldHistory, settings: WorldSettings, t: float) -> WorldState:
    """Return the state just before a time that the history has reached [s]."""
    history = history.copy()
    history.back_to(t)
    return WorldState(
        t,
        parts={name: history.rows(("spans", name))[-1] for name in settings.parts},
        on=tuple(sorted(number for number, on in history.items("signal").items() if on)),
        inside={body: tuple(sorted(regions)) for body, regions in history.items("in").items() if regions},
        used=history.items("used"),
        fed=history.items("fed"),
        due=tuple(
            DueHappening(due.time, due.what)
            for due in history.due
            if isinstance(due.what, CertainHappening) and not due.what.carried
        ),
        **{key: history.get(key) for key in ALONE},
    )


def restore(history: WorldHistory, settings: WorldSettings, state: WorldState) -> None:
    """Let a new history, in which all stands as at the start of the scene, begin with a state."""
    history.now = state.time
    for key in ALONE:
        history.set(key, getattr(state, key))
    for name, span in state.parts.items():
        lift(history, name)
        history.add(("spans", name), span)
        if span.kind is SpanKind.RESTS:
            put(history, name, settings.solids[name], span.T)
    for number in state.on:
        history.set(("signal", number), True)
        if number in settings.computed:
            history.add((CHANGES, number), (state.time, True))
    for body, regions in state.inside.items():
        history.set(("in", body), frozenset(regions))
        for region in regions:
            history.set(("region", region), history.get(("region", region), frozenset[str]()) | {body})
            history.add((SEES, region), (state.time, True))
    for kind, counts in (("used", state.used), ("fed", state.fed)):
        for place, count in counts.items():
            history.set((kind, place), count)
    for time, what in state.due:
        if isinstance(what, PartLands):
            put(history, what.part, settings.solids[what.part], what.T)  # what falls after it falls onto it
        history.plan(time, what)
    add_grip(history, settings)
