"""Test the public robot, in this process and served: the promises of docs/python.md, and every wrong use."""

from __future__ import annotations

import gc
import re
import threading
import traceback
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import inf, nan, pi, radians
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import vrs_cli as vrs
from tests.kinematics.test_urdf import written
from tests.live import PATIENCE
from vrs_cli.__main__ import main as command
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import (
    FileDamaged,
    JointOutOfRange,
    NonexistentFile,
    ProgramNotExecutable,
    UndefinedName,
    UndefinedValue,
)
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.replies import MotionReport, ReachReport, Whereabouts

PART = vrs.trans(300, 450, -200, 90, 90, 0)
DOWN = (0, -45, 180, 0, 45, 0)
PICK = Path("programs/pick_and_place.v2")


New = Callable[[], vrs.Robot]


def moved(new: New = vrs.Robot) -> vrs.Robot:
    return new().move(*DOWN).moves(PART, at=1.0)


def test_at_a_robot_here_nothing_is_on_its_way() -> None:
    r = vrs.Robot()
    with r.without_waiting():
        r.move(10, -90, 90, 0, 0, 0)
        seen = r.preview()
        assert (seen.unconfirmed, seen.commands, seen.flagged, seen.round_trip) == (inf, (), (), 0.0)
        assert repr(seen.where()) == repr(r.where())
        assert repr(seen).endswith("confirmed all, 0 commands on the way>")
    assert repr(seen.where([0.1, 0.2])) == repr(r.where([0.1, 0.2]))
    with pytest.raises(vrs.MotionError, match="Joint 1"), r.without_waiting():
        r.move(999, 0, 0, 0, 0, 0).move(0, 999, 0, 0, 0, 0).move(0, -90, 90, 0, 0, 0)
    assert r.where(r.end).joints.tolist() == pytest.approx([0, -90, 90, 0, 0, 0]), "the others were done"


def test_motions_are_those_of_val2_to_the_bit(new: New) -> None:
    typed = new()
    typed.do("MOVE #PPOINT(0, -45, 180, 0, 45, 0)")
    typed.do("MOVES TRANS(300, 450, -200, 90, 90, 0) AT 1")
    assert moved(new).timeline == typed.timeline
    assert [one.text for one in moved(new).commands] == [one.text for one in typed.commands]


def test_joints_may_be_given_in_many_ways() -> None:
    ways: tuple[Callable[[vrs.Robot], vrs.Robot], ...] = (
        lambda r: r.move(*DOWN),
        lambda r: r.move(DOWN),
        lambda r: r.move(list(DOWN)),
        lambda r: r.move(np.array(DOWN)),
        lambda r: r.move(np.array(DOWN, dtype=np.int32)),
    )
    first, *others = (way(vrs.Robot()).timeline for way in ways)
    assert all(other == first for other in others)


def test_what_the_robot_keeps_is_its_own(new: New) -> None:
    joints = np.array(DOWN, dtype=float)
    r = new().move(joints)
    before = r.where().joints.tolist()
    joints[:] = 7.0
    assert r.where().joints.tolist() == before


def test_units_of_si(new: New) -> None:
    r = new().in_units("SI").move([radians(q) for q in DOWN])
    assert r.where().joints == pytest.approx([radians(q) for q in DOWN])
    assert r.where().xyz == pytest.approx(r.in_units("VAL").where().xyz / 1000.0)
    assert r.in_units("VAL").where().joints == pytest.approx(DOWN)
    assert r.in_units("VAL").timeline is r.timeline
    assert r.ik(PART).joints == pytest.approx(np.radians(r.in_units("VAL").ik(PART).joints), nan_ok=True)


def test_where_at_one_time_and_at_many(new: New) -> None:
    r = moved(new)
    one = r.where(0.5)
    assert (one.joints.shape, one.xyz.shape, one.velocity.shape, one.location.shape) == ((6,), (3,), (6,), ())
    many = r.where([0.0, 0.5, r.end + 9.0])
    assert (many.joints.shape, many.xyz.shape, len(many)) == ((3, 6), (3, 3), 3)
    assert many.joints[1] == pytest.approx(one.joints)
    assert r.where(1).joints.tolist() == r.where(1.0).joints.tolist()
    assert repr(r.where(0.0)).startswith("Posture at 0.000 s: joints (0, -90, 90, 0, 0, 0) deg, xyz (-20.32, 149.09, ")
    assert repr(many) == f"Posture at 3 times, 0.000 to {r.end + 9.0:.3f} s: joints (3, 6), xyz (3, 3)"


def test_samples_go_to_the_exact_end(new: New) -> None:
    r = moved(new)
    samples = r.sample(rate=100)
    assert samples.joints.shape == (len(samples), 6)
    assert samples.t[:3].tolist() == [0.0, 0.01, 0.02]
    assert samples.t[-1] == r.end
    assert samples.xyz[-1] == pytest.approx([300, 450, -200])
    assert samples.speed.max() > 100.0
    assert r.sample(10, 0.5, 1.0).t.tolist() == pytest.approx([0.5, 0.6, 0.7, 0.8, 0.9, 1.0])


def test_a_robot_that_has_not_moved() -> None:
    r = vrs.Robot(start=DOWN)
    assert r.where().joints == pytest.approx(DOWN)
    assert r.sample().joints.shape == (1, 6)
    assert r.commands == ()
    with pytest.raises(vrs.UsageError, match="there is no motion yet"):
        r.plot()


def test_speed_is_for_one_motion() -> None:
    full, half = vrs.Robot().move(*DOWN), vrs.Robot().move(*DOWN, speed=50)
    assert half.end > 1.5 * full.end


def test_real_time_takes_its_time() -> None:
    r = vrs.Robot(realtime=1000.0).move(*DOWN, at=1e6)
    assert r.now < r.end
    r = vrs.Robot(realtime=1000.0).move(*DOWN)
    assert r.wait().now >= r.end


def test_abort_drops_what_is_scheduled(new: New) -> None:
    r = new().move(*DOWN, at=5.0)
    assert r.end > 5.0
    assert r.abort().end <= 5.0


# --- kinematics ----------------------------------------------------------------------------------------------------


def test_forward_and_back() -> None:
    r = vrs.Robot()
    ways = r.ik(PART)
    assert (ways.joints.shape, ways.usable.shape, len(ways.configurations)) == ((8, 6), (8,), 8)
    for joints in ways.joints:
        assert np.allclose(r.fk(joints).matrix, PART.matrix, atol=1e-9)
    assert ways["lefty above noflip"].tolist() in ways.joints[ways.usable].tolist()
    assert "LEFTY ABOVE NOFLIP" in repr(ways)
    with pytest.raises(KeyError, match="there are RIGHTY"):
        ways["up"]


def test_a_second_way_of_the_same_configuration_is_numbered() -> None:
    r = vrs.Robot("xarm6")
    joints = (161.117, -2.187, -172.653, -126.240, 96.781, -240.430)
    ways = r.ik(r.fk(joints))
    assert len({*ways.configurations}) == len(ways.configurations) == len(ways.joints) > 8
    numbered = next(name for name in ways if name.endswith(" 2") and not np.isnan(ways[name]).any())
    assert not np.isnan(ways[numbered.removesuffix(" 2")]).any()
    off = np.abs((ways.joints - joints + 180.0) % 360.0 - 180.0).max(axis=1)
    assert np.nanmin(off) < 1e-6


def test_kinematics_of_arrays() -> None:
    r = vrs.Robot()
    places = vrs.trans(np.linspace(200, 3000, 7), 450, -200, 90, 90, 0)
    ways = r.ik(places)
    assert (ways.joints.shape, ways.usable.shape, ways.best.shape) == ((7, 8, 6), (7, 8), (7, 6))
    assert np.isnan(ways.best[-1]).all()
    reached = ways.usable.any(axis=1)
    assert r.fk(ways.best[reached]).xyz == pytest.approx(places.xyz[reached])
    assert r.jacobian(ways.best[reached]).shape == (int(reached.sum()), 6, 6)
    assert repr(ways) == f"Ways to 7 locations, {reached.sum()} of them usable: joints (7, 8, 6)"


def test_the_jacobian_is_the_derivative() -> None:
    r, q, h = vrs.Robot(), np.array(DOWN, dtype=float), 1e-4
    J = r.jacobian(q)
    for joint in range(6):
        step = np.zeros(6)
        step[joint] = h
        column = (r.fk(q + step).xyz - r.fk(q - step).xyz) / (2 * h)
        assert J[:3, joint] == pytest.approx(column, abs=1e-5)
    si = r.in_units("SI").jacobian(np.radians(q))
    assert J[:3] == pytest.approx(si[:3] * 1000.0 * pi / 180.0)
    assert J[3:] == pytest.approx(si[3:])


def test_kinematics_with_tool_and_base(new: New) -> None:
    r = new()
    r.do("TOOL TRANS(0, 0, 100)")
    r.do("BASE 50, 0, 0")
    assert r.fk().xyz == pytest.approx(r.where().xyz)
    best = r.ik(r.where().location).joints
    assert any(np.allclose(row, r.where().joints, atol=1e-6) for row in best)


def test_the_speed_of_all_motions(new: New) -> None:
    r = new()
    assert r.speed == 100.0
    full = r.move(30, -90, 90, 0, 0, 0, at=0).end
    r.undo()
    r.speed = 50
    assert r.speed == 50.0
    assert r.move(30, -90, 90, 0, 0, 0, at=0).end > 1.2 * full
    for wrong in (0, -1, 328, inf, nan):
        with pytest.raises(vrs.VrsError):
            r.speed = wrong
    assert r.speed == 50.0


def test_a_robot_whose_joints_slide() -> None:
    r = vrs.Robot("cobra600")
    q = r.where().joints
    assert r.fk(q).xyz == pytest.approx(r.where().xyz)
    assert r.in_units("SI").where().joints[2] == pytest.approx(q[2] / 1000.0)
    assert r.jacobian().shape == (6, 4)


def test_why_is_data(new: New) -> None:
    (report,) = new().why(PART)
    assert isinstance(report, ReachReport)
    assert len(report.reach.options) == 8
    assert "MOVE: " in repr(new().why(PART))
    assert "mm too far" in repr(new().why(vrs.trans(3000, 0, 0)))


def test_explain_is_data_text_markdown_and_latex(new: New) -> None:
    r = new()
    before = r.timeline
    told = r.explain("MOVE TRANS(300, 450, -100, 90, 90, 0)")
    (report,) = told
    assert isinstance(report, MotionReport)
    assert r.timeline == before
    r.move(vrs.trans(300, 450, -100, 90, 90, 0))
    assert report.plan is not None
    assert report.plan.end == r.end
    assert told.text.startswith("MOVE TRANS(300, 450, -100, 90, 90, 0) begins at 0.000")
    turns = r.explain("OAT TRANS(1, 2, 3, 30, 40, 50)")
    assert r"$$R = [n\,s\,a] = R_{z}(O)\,M\,R_{y}(A)\,R_{z}(T)$$" in turns._repr_markdown_()
    assert r"\begin{bmatrix}" in turns._repr_latex_()
    assert turns._repr_html_ is None
    assert "EXPLAIN motion" in repr(r.explain())
    with pytest.raises(vrs.VrsError):
        r.explain("MOVE nowhere")


# --- programs and words --------------------------------------------------------------------------------------------


def test_do_answers_with_values(new: New) -> None:
    r = new()
    (where,) = r.do("WHERE")
    assert isinstance(where, Whereabouts)
    assert r.do("SPEED 50") == ()
    assert repr(r.do('TYPE "x is", 3')) == "x is 3"
    assert "JT1" in repr(r.do("WHERE"))
    assert r.do('TYPE "no end of the line", /S').text == "no end of the line\n"
    assert r.do('TYPE "next"').text == "next\n"


def test_do_answers_questions(new: New) -> None:
    r = new()
    r.define(".PROGRAM a\nTYPE 1\n.END")
    r.do("DELETEP a")
    assert "a" in repr(r.do("DIRECTORY"))
    r.do("DELETEP a", answers=["Y"])
    with pytest.raises(UndefinedName):
        r.execute("a")


def test_run_a_file_and_read_its_result(new: New) -> None:
    r = new()
    run = r.run(PICK)
    assert run.ok
    assert run.typed[-1] == "The hand is open: 1"
    assert repr(run).splitlines()[-1] == f"pick.and.place: Program completed, {run.seconds:.3f} s"
    assert isinstance(r["part"], vrs.Location)


def test_programs_of_a_text(new: New) -> None:
    r = new()
    assert r.define(".PROGRAM double(x)\nx = 2*x\n.END\n.PROGRAM main\nn = 4\nCALL double(n)\n.END") == (
        "double",
        "main",
    )
    r.execute("main")
    assert r["n"] == 8.0


def test_a_prompt_has_its_answers(new: New) -> None:
    r = new()
    r.define('.PROGRAM ask\nPROMPT "How many? ", n\n.END')
    r.execute("ask", answers=["3"])
    assert r["n"] == 3.0
    with pytest.raises(vrs.ProgramFailed, match="How many"):
        r.execute("ask")


def test_a_program_that_fails(new: New) -> None:
    r = new()
    r.define(".PROGRAM bad\nTYPE 1\nx = y\n.END")
    with pytest.raises(vrs.ProgramFailed, match=r"^bad step 2, x = y: \*Undefined value\* y[^\n]*$") as caught:
        r.execute("bad")
    assert caught.value.result.typed == (" 1",)
    assert not r.execute("bad", check=False).ok


def test_a_text_with_mistakes(new: New) -> None:
    with pytest.raises(ProgramNotExecutable, match=r"line 2: .*MOVEE"):
        new().define(".PROGRAM a\nMOVEE b\n.END")


def test_a_program_asks_and_leaves_variables(new: New, tmp_path: Path) -> None:
    text = '.PROGRAM ask()\n  PROMPT "How many? ", count\n  twice = 2*count\n  TYPE "twice:", twice\n.END\n'
    one = new()
    assert one.define(text) == ("ask",)
    run = one.execute("ask", answers=["4"])
    assert (run.ok, run.typed, one["twice"]) == (True, ("twice: 8",), 8.0)
    with pytest.raises(vrs.ProgramFailed, match="PROMPT"):
        one.execute("ask")
    one["#home"], one["$s"], one["n"], one["part"] = DOWN, "text", 0.1, PART
    assert (one["$s"], one["n"], repr(one["part"])) == ("text", 0.1, repr(PART))
    assert one["#home"].tolist() == pytest.approx(DOWN)  # type: ignore[union-attr]
    path = tmp_path / "two.v2"
    path.write_text(".PROGRAM two()\n  TYPE 2\n.END\n")
    assert one.run(path).typed == (" 2",)
    with pytest.raises(NonexistentFile):
        one.run(tmp_path / "none.v2")


def test_variables(new: New) -> None:
    r = new()
    r["count"], r["part"], r["#safe"], r["$name"], r["row[3]"] = 5, PART, DOWN, "pin", 2.5
    assert (r["count*2"], r["$name"], r["row[3]"]) == (10.0, "pin", 2.5)
    assert r["part"] == PART
    assert r["#safe"] == pytest.approx(DOWN)
    r.do("MOVE part")
    assert r.where().xyz == pytest.approx(PART.xyz)


# --- the past, other courses of events, files ----------------------------------------------------------------------


def test_undo_and_redo(new: New) -> None:
    r = moved(new)
    after = r.timeline
    assert len(r.undo().commands) == 1
    assert r.redo().timeline == after
    assert r.undo(2).commands == ()
    with pytest.raises(vrs.UsageError, match="no motion to undo"):
        r.undo()


def test_a_chunk_is_followed_and_taken_back(new: New) -> None:
    r = moved(new)
    before, start = r.timeline, r.where(r.end).joints
    times = r.end + np.arange(0.5, 2.5, 0.05)
    rows = start + 5.0 * (1.0 - np.cos(times - times[0]))[:, None] * [1.0, 1.0, -1.0, 0.0, 0.0, 1.0]
    found = r.follow(times, rows)
    assert max(found.worst) < 0.5  # degrees
    assert r.where(found.end).joints == pytest.approx(rows[-1], abs=1e-9)
    assert r.commands[-1].text == "FOLLOW"
    with pytest.raises(vrs.VrsError, match="not after"):
        r.follow([5.0, 4.0], rows[:2])
    with pytest.raises(ValueError, match=r"times \(N,\) and joints \(N, n\) are wanted"):
        r.follow([[5.0]], rows[:1])
    assert r.undo().timeline == before


def test_branches(new: New) -> None:
    r = moved(new)
    before = r.timeline
    with r.what_if("slow") as trial:
        trial.move(*DOWN, speed=10)
        assert r.branch == "slow"
    assert (r.branch, r.branches, r.timeline) == ("main", ("main", "slow"), before)
    assert "Cycle time" in repr(r.compare("main", "slow"))
    r.merge("slow")
    assert (r.branches, len(r.commands)) == (("main",), 3)


def test_branches_are_compared_merged_and_saved(new: New, tmp_path: Path) -> None:
    one = new()
    one.move(*DOWN)
    with one.what_if("straight"):
        end = one.moves(PART).end
        assert one.branch == "straight"
    assert one.end < end
    with one.what_if("joints"):
        one.move(PART)
    (table,) = one.compare("straight", "joints")
    assert round(table.comparison.b.duration - table.comparison.a.duration, 3) == -0.449  # type: ignore[union-attr]
    assert one.branches == ("main", "straight", "joints")
    one.merge("joints")
    (report,) = one.why(vrs.trans(1000, 450, -200, 90, 90, 0))
    assert isinstance(report, ReachReport)
    assert report.reach.chosen is None
    one.save(tmp_path / "t.vrst")
    assert vrs.load(tmp_path / "t.vrst").timeline == one.timeline
    assert "MOVE" in one._repr_html_()
    assert one.plot("velocity").curves


def test_a_branch_is_left_also_after_an_error(new: New) -> None:
    r = new()
    with pytest.raises(vrs.MotionError), r.what_if("far"):
        r.move(vrs.trans(5000, 0, 0))
    assert r.branch == "main"


def test_save_and_load(tmp_path: Path) -> None:
    r, path = moved(), tmp_path / "t.vrst"
    r.save(path)
    again = vrs.load(path)
    assert again.timeline == r.timeline
    assert again.now == r.end
    assert again.undo().timeline == r.undo().timeline
    again.move(0, -90, 90, 0, 0, 0)
    with pytest.raises(NonexistentFile):
        vrs.load(tmp_path / "none.vrst")
    path.write_text("no trajectory")
    with pytest.raises(FileDamaged):
        vrs.load(path)


def test_a_file_that_was_not_written_to_its_end_is_told(tmp_path: Path) -> None:
    path = tmp_path / "t.vrst"
    moved().save(path)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.warns(UserWarning, match="t.vrst: its last line was not written to the end"):
        assert len(vrs.load(path).commands) == 1


def test_a_robot_that_nobody_holds_leaves_nothing_behind() -> None:
    before = set(threading.enumerate())
    r = vrs.Robot()
    r.subscribe(lambda _change: None)
    (thread,) = set(threading.enumerate()) - before
    left = weakref.ref(r._robot)
    del r
    gc.collect()
    thread.join(PATIENCE)
    assert left() is None
    assert not thread.is_alive()


def test_subscribe(new: New) -> None:
    r, heard = new(), list[vrs.Change]()
    end = r.subscribe(heard.append)
    moved_to = r.move(*DOWN).timeline
    r.undo()
    end()
    r.move(*DOWN)
    assert [change.version for change in heard] == [0, 1, 2]
    assert heard[0].delta is None
    assert heard[1].timeline == moved_to
    assert heard[1].delta is not None
    assert repr(heard[1]).startswith("<Change to version 1: MOVE #PPOINT(0, -45, 180, 0, 45, 0), to ")


def test_reads_in_real_time_follow_the_clock() -> None:
    r = vrs.Robot(realtime=50.0).move(*DOWN)
    before = r.now
    while r.now == before:
        pass
    assert r.where().t > before


def test_abort_overtakes_a_program_in_real_time() -> None:
    r, runs = vrs.Robot(realtime=True), list[vrs.Run]()
    r.define(".PROGRAM endless\nDO\n DELAY 1\n BREAK\nUNTIL FALSE\n.END")
    thread = Thread(target=lambda: runs.append(r.execute("endless", check=False)))
    thread.start()
    while not r.commands:
        pass
    r.abort()
    thread.join(PATIENCE)
    assert [run.outcome.value for run in runs] == ["(ABORTED)"]
    assert r.where(r.end).t < 20.0


def test_a_prompt_of_another_thread_is_answered_by_who_runs_it() -> None:
    r, failed = vrs.Robot(), list[str]()
    r.define('.PROGRAM ask\nPROMPT "n? ", n\nREADY\n.END')

    def run(answers: list[str]) -> None:
        try:
            r.execute("ask", answers=answers)
        except vrs.ProgramFailed as error:
            failed.append(str(error))

    def move() -> None:
        while len(r.commands) < 20:
            with suppress(vrs.UsageError):  # it has to wait while a program asks
                r.move(*DOWN)

    threads = [Thread(target=run, args=(answers,)) for answers in (["1"], [], ["2"])] + [Thread(target=move)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert len(failed) == 1
    assert "has nothing more to read" in failed[0]
    texts = [command.text for command in r.commands]
    assert texts.count("READY") == 2
    assert len(texts) >= 20


def test_many_threads() -> None:
    r = vrs.Robot()
    threads = [Thread(target=lambda: [r.move(*DOWN).ready() for _ in range(5)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(r.commands) == 40
    assert r.timeline.version == 40


# --- how it shows itself -------------------------------------------------------------------------------------------


def test_it_says_what_it_is(new: New) -> None:
    r = moved(new).wait()
    assert re.fullmatch(
        r"<Robot puma560: 2 motions to \d\.\d{3} s, now 2\.168 s, xyz \(.*\) mm, oat \(.*\) deg>", repr(r)
    )
    assert re.fullmatch(r"<Timeline version 2: \d+ segments, 0\.000 to \d\.\d{3} s>", repr(r.timeline))
    assert repr(Engine(load_robot("puma560"))).startswith("<Engine of puma560 at 0.000 s: <Timeline version 0: 1 segm")


def test_plots(new: New) -> None:
    plot = moved(new).plot("velocity", 1, 2)
    assert list(plot.curves) == ["JT1", "JT2"]
    assert len(plot.times) == len(plot.curves["JT1"])
    assert plot._repr_svg_().startswith("<svg ")
    assert "Joint velocities" in repr(plot)


def test_tables_in_a_notebook(new: New) -> None:
    assert "<table>" in moved(new).do("TIMELINE")._repr_html_()
    assert "<table>" in moved(new)._repr_html_()
    assert "&lt;" in new().do('TYPE "a < b"')._repr_html_()


# --- held wrong ----------------------------------------------------------------------------------------------------

WRONG: tuple[tuple[Callable[[vrs.Robot], object], type[Exception], str], ...] = (
    (lambda r: r.move(1, 2, 3), ValueError, r"joints: the shape \(3,\) does not fit, \(6,\) or"),
    (lambda r: r.move(np.zeros((2, 6))), ValueError, r"joints: one set of joints is wanted, not \(2, 6\)"),
    (lambda r: r.move("part"), TypeError, "joints: numbers are wanted, not 'part'"),
    (lambda r: r.move(), ValueError, r"joints: the shape \(0,\)"),
    (lambda r: r.move(PART, PART), TypeError, "joints: numbers are wanted"),
    (lambda r: r.move(nan, 0, 0, 0, 0, 0), ValueError, "joints: finite numbers"),
    (lambda r: r.move(vrs.trans([1, 2])), ValueError, "location: one is wanted"),
    (lambda r: r.move(*DOWN, at=nan), ValueError, "at: finite"),
    (lambda r: r.move(*DOWN, at="1"), TypeError, "at: numbers are wanted, not '1'"),  # type: ignore[arg-type]
    (lambda r: r.move(*DOWN, at=-1), vrs.ProgramError, r"\*Illegal value\* at -1 s"),
    (lambda r: r.move(*DOWN, speed=0), ValueError, "speed: percent of nominal"),
    (lambda r: r.move(*DOWN, speed=101), ValueError, "speed: percent of nominal"),
    (
        lambda r: r.moves(300, 450, -200, 90, 90, 0),
        vrs.MotionError,
        r"Joint 1 out of .* joints; trans",
    ),
    (lambda r: r.move(vrs.trans(5000, 0, 0)), vrs.MotionError, r"\*Location too far\*"),
    (lambda r: r.where("x"), TypeError, "t: numbers are wanted, not 'x'"),
    (lambda r: r.where([[1.0]]), ValueError, "t: one time or an array"),
    (lambda r: r.where(nan), ValueError, "t: finite"),
    (lambda r: r.sample(0), ValueError, "rate: more than 0"),
    (lambda r: r.sample(-5), ValueError, "rate: more than 0"),
    (lambda r: r.fk([1, 2]), ValueError, "joints: the shape"),
    (lambda r: r.ik([1, 2, 3, 4, 5, 6]), TypeError, "location: a Location is wanted"),  # type: ignore[arg-type]
    (lambda r: r.jacobian("q"), TypeError, "joints: numbers"),
    (lambda r: r.do("MOVEE a"), vrs.VrsError, "MOVEE"),
    (lambda r: r.do(5), TypeError, "line: a text is wanted"),  # type: ignore[arg-type]
    (lambda r: r.do("WHERE\nWHERE"), ValueError, "line: one line is wanted"),
    (lambda r: r["1 +"], vrs.VrsError, "1 \\+|Illegal|interpret"),
    (lambda r: r["nothing"], vrs.ProgramError, "Undefined value"),
    (lambda r: r.__setitem__("x", "text"), vrs.ProgramError, "x cannot hold a string"),
    (lambda r: r.__setitem__("x+1", 3), vrs.UsageError, "no variable"),
    (lambda r: r.__setitem__("#p", [1, 2]), ValueError, "#p: the shape"),
    (lambda r: r.run("nothing.v2"), NonexistentFile, "nothing.v2"),
    (lambda r: r.save("/nonexistent/t.vrst"), vrs.FileError, "nonexistent"),
    (lambda r: r.plot("colour"), vrs.UsageError, "COLOUR is no curve"),
    (lambda r: r.compare("main", "none"), vrs.UsageError, "there is no branch none"),
    (lambda r: r.in_units("cm"), ValueError, "units 'cm'"),
    (lambda _r: vrs.Robot("puma999"), NonexistentFile, "no robot is called 'puma999'"),
    (lambda _r: vrs.Robot(start=[1, 2]), ValueError, "start: the shape"),
    (lambda _r: vrs.Robot(realtime=-1), ValueError, "realtime: "),
)


@pytest.fixture(scope="module", params=["here", "served"])
def untouched(request: pytest.FixtureRequest) -> Iterator[vrs.Robot]:
    """Yield a robot that refuses all that the test asks of it."""
    if request.param == "here":
        yield vrs.Robot()
    else:
        with vrs.connect(next(request.getfixturevalue("served"))) as r:
            yield r


@pytest.mark.parametrize(("wrong", "kind", "said"), WRONG)
def test_one_clear_line_for_what_is_wrong(
    untouched: vrs.Robot, wrong: Callable[[vrs.Robot], object], kind: type[Exception], said: str
) -> None:
    r = untouched
    with pytest.raises(kind, match=said) as caught:
        wrong(r)
    assert "\n" not in str(caught.value)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None
    assert len(traceback.extract_tb(caught.value.__traceback__)) <= 9
    assert r.timeline.version == 0


def test_what_is_refused_has_its_class_and_numbers(new: New) -> None:
    one = new()
    with pytest.raises(JointOutOfRange, match=r"would be 200\.00 deg") as caught:
        one.move(200, 0, 0, 0, 0, 0)
    assert caught.value.joint == 1
    with pytest.raises(UndefinedValue, match="nowhere"):
        one["nowhere"]
    with pytest.raises(vrs.VrsError, match=r"\*Illegal monitor command\* MOVEE"):
        one.do("MOVEE a")
    with pytest.raises(ProgramNotExecutable, match="line 2: "):
        one.define(".PROGRAM a()\n  MOVEE b\n.END\n")
    with pytest.raises(vrs.UsageError):
        one.undo(99)


def test_the_links_are_chosen_by_name(tmp_path: Path) -> None:
    file = written(tmp_path)
    usual, lens = vrs.Robot(file, start=[0, 0, 0]), vrs.Robot(file, start=[0, 0, 0], tip="lens")
    raised = vrs.Robot(file, start=[0, 0, 0], base="base")
    assert lens.where().location.xyz - usual.where().location.xyz == pytest.approx([0.0, 1000.0, -70.0], abs=1e-6)
    assert usual.where().location.xyz - raised.where().location.xyz == pytest.approx([0.0, 0.0, 500.0], abs=1e-6)
    with pytest.raises(vrs.VrsError, match="no joint has a link 'nose'"):
        vrs.Robot(file, tip="nose")


@pytest.mark.parametrize("ending", ["csv", "json", "npz", "mcap"])
def test_samples_are_exported_as_by_the_command(ending: str, new: New, tmp_path: Path) -> None:
    if ending == "mcap":
        pytest.importorskip("mcap")
    r, path = moved(new), tmp_path / f"moved.{ending}"
    r.export(path, rate=50)
    r.save(tmp_path / "moved.vrst")
    command(["export", str(tmp_path / "moved.vrst"), "--to", ending, "--rate", "50", "-o", str(tmp_path / "other")])
    assert path.read_bytes() == (tmp_path / "other").read_bytes()


def test_what_is_no_export_is_refused(tmp_path: Path) -> None:
    r = moved()
    with pytest.raises(ValueError, match=r"path: it ends in .csv, .json, .npz, .mcap, not .*txt"):
        r.export(tmp_path / "moved.txt")
    with pytest.raises(ValueError, match="rate: more than 0"):
        r.export(tmp_path / "moved.csv", rate=0)
    with pytest.raises(vrs.FileError):
        r.export("/none/of/these.csv")
