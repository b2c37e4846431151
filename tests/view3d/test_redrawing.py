"""A picture is made as often as it may cost."""

from __future__ import annotations

from itertools import pairwise

from vrs_cli.view3d.parts import COSTS, LEAST, Redrawing


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_what_changes_all_the_time_is_drawn_as_often_as_it_may_cost() -> None:
    clock, drawn = Clock(), list[float]()
    redrawing = Redrawing(clock)

    def draw() -> None:
        drawn.append(clock.now)
        clock.now += 0.1

    for k in range(1000):
        clock.now = max(clock.now, 0.02 * k)
        redrawing.look(k, "same", draw)
    assert len(drawn) == round(1000 * 0.02 / (0.1 + 0.1 * COSTS))
    assert min(b - a for a, b in pairwise(drawn)) >= 0.1 * COSTS


def test_what_stays_is_not_drawn_again_and_what_is_urgent_at_once() -> None:
    clock, drawn = Clock(), list[object]()
    redrawing = Redrawing(clock)
    for of, urgent in [(1, 1), (1, 1), (2, 1), (2, 2), (2, 2)]:
        redrawing.look(of, urgent, lambda of=of, urgent=urgent: drawn.append((of, urgent)))
    assert drawn == [(1, 1), (2, 2)]
    clock.now = LEAST
    redrawing.look(3, 2, lambda: drawn.append(3))
    assert drawn[-1] == 3
