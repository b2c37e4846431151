"""The notebook of the paper: its cells print and draw what is kept in it, and its numbers are those of formulas."""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.docs.makers import maker
from vrs_cli.lab.delays import Strategy
from vrs_cli.trajectory.segment import Phase

MADE = maker("make_paper")
KEPT = MADE.read()
V, A = 82.0, 273.0  # [deg/s, deg/s2] of joint 1 of a PUMA
V2, A2 = 54.0, 180.0  # of joint 2
NEAR = 1e-6  # [s] motions keep a millionth away from the limits, and times are multiples of 2^-30 s
TENTHS = 0.11  # [px] by which a curve may be elsewhere on another machine
NUMBER = re.compile(r"-?\d+\.\d+")

Cells = dict[str, Any]


@pytest.fixture(scope="module")
def ran() -> tuple[Cells, dict[str, Any]]:
    """The notebook with what its cells print and draw now, and their variables."""
    notebook = MADE.read()
    return notebook, MADE.run(notebook)


@pytest.fixture(scope="module")
def found(ran: tuple[Cells, dict[str, Any]]) -> dict[str, Any]:
    return ran[1]


def printed(notebook: Cells) -> list[str]:
    return [
        "".join(output["text"])
        for cell in notebook["cells"]
        for output in cell.get("outputs", ())
        if output["output_type"] == "stream"
    ]


def drawn(notebook: Cells) -> list[str]:
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", ())]
    return ["".join(output["data"]["image/svg+xml"]) for output in outputs if "data" in output]


def starts(timeline: Any) -> list[float]:
    return [segment.start for segment in timeline]


def test_the_cells_print_what_is_kept(ran: tuple[Cells, dict[str, Any]]) -> None:
    assert printed(ran[0]) == printed(KEPT), "run python docs/make_paper.py"
    assert len(printed(KEPT)) >= 18


def test_the_figures_are_those_that_are_kept(ran: tuple[Cells, dict[str, Any]]) -> None:
    now, kept = drawn(ran[0]), drawn(KEPT)
    assert [NUMBER.sub("", svg) for svg in now] == [NUMBER.sub("", svg) for svg in kept], "python docs/make_paper.py"
    for one, other in zip(now, kept, strict=True):
        numbers = [np.array([float(x) for x in NUMBER.findall(svg)]) for svg in (one, other)]
        assert np.abs(numbers[0] - numbers[1]).max() <= TENTHS
    titles = [ElementTree.fromstring(svg)[0].text or "" for svg in kept]
    assert [re.match(r"Figure (\d)", title)[1] for title in titles] == ["1", "4", "5", "6"]  # type: ignore[index]


def test_equation_6_has_the_times_of_parabolic_blends(found: dict[str, Any]) -> None:
    v = 0.8 * V
    expected = [0.0, 0.5, 0.5 + v / A, 0.5 + 60 / v]
    assert starts(found["tau_1"]) == pytest.approx(expected, abs=NEAR)
    assert found["tau_1"].end == pytest.approx(0.5 + 60 / v + v / A, abs=NEAR)
    assert found["whole"] == pytest.approx(found["tau_1"].end - 0.5, abs=NEAR)
    assert found["by_hand"] == pytest.approx(0.5 * v * v / A + v * (0.25 - v / A), abs=1e-5)


def test_figure_1_is_the_splice_of_the_paper(found: dict[str, Any]) -> None:
    before, after, v = found["tau_1"], found["tau_2"], 0.8 * V
    at = 0.5 * v * v / A + v * (0.45 - v / A)  # [deg] when the command comes
    turned = 0.95 + 2.0 * v / A  # there again, at -v
    slows = turned + (at + 20.0 - 0.5 * v * v / A) / v
    assert starts(after)[3:] == pytest.approx([0.95, turned, slows], abs=NEAR)
    assert after.end == pytest.approx(slows + v / A, abs=NEAR)
    assert [one.phase for one in after][1:] == [
        Phase.ACCELERATE,
        Phase.CRUISE,
        Phase.BLEND,
        Phase.CRUISE,
        Phase.DECELERATE,
    ]
    assert (found["m"], found["n"]) == (2, 1)
    assert before[1] == after[1]
    assert (before[2].start, before[2].path) == (after[2].start, after[2].path)
    old, new = found["figure_1"].panels[0].columns
    same = found["figure_1"].panels[0].along <= 0.95
    assert np.array_equal(old[same], new[same])
    assert (np.abs(old - new)[~same][1:] > 1e-3).all()
    assert (new[-1], old[-1]) == (pytest.approx(-20.0), pytest.approx(60.0))


def test_what_follows_is_planned_again_or_shifted(found: dict[str, Any]) -> None:
    slow, blend = max(20 / V, 30 / V2), max(20 / A, 30 / A2)
    again = slow + blend / slow  # the second motion, from 40 degrees to 60 and from -90 to -60
    assert found["delta"].shift == pytest.approx(0.95 + 3.9 + again - 4.0, abs=NEAR)
    assert found["gap"] == pytest.approx(20.0)
    for before, after in zip(list(found["tau_3"])[-6:], list(found["tau_4"])[-6:], strict=True):
        assert before.path == after.path
        assert after.start - before.start == found["delta"].shift


def test_real_time_postpones_to_the_end_of_the_interval(found: dict[str, Any]) -> None:
    assert found["current"].finish == pytest.approx(0.5 + 60 / V, abs=NEAR)
    begun = [one.start for one in found["postpones"].engine.timeline if one.phase is Phase.BLEND]
    assert begun == [found["current"].finish]
    assert (found["frames"], found["computed"]) == ([50, 10], 50)


def test_delays_do_what_the_paper_says(found: dict[str, Any]) -> None:
    total = found["D_f"] + found["D_b"]
    assert found["lag"] == pytest.approx(V * found["D_b"], abs=1e-5)
    assert found["total"][1] - found["total"][0] == pytest.approx(total, abs=0.0051)
    wrong = found["times"][found["wrong"]]
    assert found["t_iss"] < wrong[0] < wrong[-1] < found["t_iss"] + total
    assert wrong[-1] - wrong[0] == pytest.approx(total, abs=0.0151)
    s = wrong[-1] - found["t_iss"]
    missed = 0.5 * V * V / A + V * (s - V / A)
    assert np.abs(found["predicted"] - found["plain_wish"]).max() == pytest.approx(missed, abs=1e-5)
    assert found["error"] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(found["shown"] - found["meant"]).max() == pytest.approx(0.0, abs=1e-9)
    assert found["forward"].engine.timeline[1].start == found["t_iss"] + total
    assert found["near"].engine.timeline == found["remote"].engine.timeline


def test_the_timeline_at_the_viewer_is_wrong_only_where_it_is_flagged(found: dict[str, Any]) -> None:
    for lead, it in found["results"].items():
        assert it.agreed
        assert it.outside.most_degrees == 0.0
        assert (
            it.errors[Strategy.DELTAS].degrees
            < it.errors[Strategy.PREDICTED].degrees
            < it.errors[Strategy.FRAMES].degrees
        )
        assert (it.aborted == 0) is (lead > 0.5)
    assert found["results"][0.8].errors[Strategy.PREVIEW].degrees < 0.001
