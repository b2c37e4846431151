"""Test limits, folders, cells and signals of a robot and of one call, and streams of targets."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from contextlib import suppress
from math import inf
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

import vrs_cli as vrs
from tests.net.serving import serving
from vrs_cli.errors import (
    FileDamaged,
    FileError,
    FileOutside,
    IllegalSignal,
    JointOutOfRange,
    LimitReached,
    RequestRefused,
    UsageError,
)

EVER = ".PROGRAM ever()\n10 GOTO 10\n.END\n"
LOG = """\
.PROGRAM log()
    ATTACH (5)
    FOPENW (5) "log.txt"
    WRITE (5) "logged"
    FCLOSE (5)
    FDELETE (5) "given.txt"
    TYPE IOSTAT(5)
.END
"""
WAITS = '.PROGRAM waits()\n    WAIT SIG(1001)\n    TYPE "on"\n.END\n'
CELL = '[signals]\n"go" = 3\n"there" = 1001\n[[follow]]\nwhen = "go"\nset = "there"\nafter = 0.8\n'
GOES = ".PROGRAM goes()\n    SIGNAL 3\n    WAIT SIG(1001)\n    SIGNAL -3\n.END\n"
FEW = vrs.Limits(max_steps=1000)

Ask = Callable[[vrs.Robot], object]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here" / "sub").mkdir(parents=True)
    (tmp_path / "secret.txt").write_text("secret\n")
    monkeypatch.chdir(tmp_path / "here")
    for name, text in (("given.txt", "given\n"), ("sub/log.v2", LOG), ("sub/ever.v2", EVER), ("cell.toml", CELL)):
        Path(name).write_text(text)
    Path("link.txt").symlink_to("../secret.txt")
    Path("out").symlink_to("..")


def defined(*texts: str) -> vrs.Robot:
    r = vrs.Robot()
    r.define("".join(texts))
    return r


@pytest.mark.parametrize(
    "ask",
    [
        lambda r: r.run("sub/ever.v2", check=False, limits=FEW).fault.message,
        lambda r: r.execute("ever", check=False, limits=FEW).fault.message,
        lambda r: r.do("EXECUTE ever", limits=FEW).text,
        lambda _: vrs.Robot(limits=FEW).run("sub/ever.v2", check=False).fault.message,  # type: ignore[union-attr]
    ],
)
def test_limits_end_an_endless_program_with_the_reason(ask: Callable[[vrs.Robot], str]) -> None:
    told = ask(defined(EVER))
    assert "still running after 1000 steps: ever step 1 is busy at 10 GOTO 10 (limits=Limits(max_steps=...)" in told


def test_limits_are_finite_unless_others_are_given() -> None:
    r = defined(EVER)
    run = r.execute("ever", check=False)
    assert run.fault is not None
    assert "after 10000000 steps" in run.fault.message
    assert None not in structs.astuple(vrs.Limits())


def test_limits_of_one_call_hold_for_it_alone() -> None:
    r = defined(".PROGRAM some()\n    FOR i = 1 TO 1000\n    END\n.END\n")
    for _ in range(2):
        assert not r.execute("some", check=False, limits=vrs.Limits(max_steps=100)).ok
        r.do("KILL")
        assert r.execute("some").ok


@pytest.mark.parametrize("limits", [{"max_steps": 0}, {"max_time": -1.0}, {"max_disk": "1G"}, {"max_output": True}])
def test_what_is_no_limit_is_refused(limits: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=f"{next(iter(limits))}: a number above 0 is wanted, or None"):
        vrs.Limits(**limits)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "ask",
    [
        lambda: vrs.Robot(limits=1000),  # type: ignore[arg-type]
        lambda: vrs.Robot(signals=[(1.0, 1001)]),  # type: ignore[list-item]
        lambda: vrs.Robot(signals=[(-1.0, 1001, True)]),
        lambda: vrs.Robot(signals=[(1.0, 1, True)]),
        lambda: vrs.Robot(cell="none.toml"),
        lambda: vrs.Robot(folder="given.txt"),
    ],
)
def test_what_is_no_condition_is_refused(ask: Callable[[], object]) -> None:
    with pytest.raises((TypeError, ValueError, FileDamaged, FileError)):
        ask()


# --- folders ---


def test_a_program_has_the_folder_of_its_file() -> None:
    r = vrs.Robot()
    assert r.run("sub/log").typed == ("-501",)
    assert Path("sub/log.txt").read_text() == "logged\n"
    Path("sub/log.txt").unlink()
    r.execute("log")
    assert Path("sub/log.txt").exists(), "it is still a program of that file"
    r.define(LOG)
    assert r.execute("log").typed == (" 1",)
    assert Path("log.txt").exists(), "a text has no file: the current folder"


@pytest.mark.parametrize("of", ["robot", "call"])
def test_a_folder_that_is_given_is_that_of_all(of: str, tmp_path: Path) -> None:
    (tmp_path / "box").mkdir()
    box = tmp_path / "box"
    r, given = (vrs.Robot(folder=box), {}) if of == "robot" else (vrs.Robot(), {"folder": box})
    r.run("sub/log.v2", **given)  # type: ignore[arg-type]
    assert r.do("FLIST log.txt", **given).text == "logged\n"  # type: ignore[arg-type]
    r.do(f"FCOPY copy.txt = {box}/log.txt", **given)  # type: ignore[arg-type]
    assert sorted(os.listdir(box)) == ["copy.txt", "log.txt"]
    assert r.do("PWD", **given).text == f"{box}\n"  # type: ignore[arg-type]


def test_the_root_folder_is_all_files(tmp_path: Path) -> None:
    assert vrs.Robot().do(f"FLIST {tmp_path.resolve()}/secret.txt", folder="/").text == "secret\n"


OUTSIDE = ("../secret.txt", "/etc/hostname", "link.txt", "out/secret.txt", "sub/../../secret.txt", "~/x")
COMMANDS = ("FLIST", "FDELETE", "LOAD", "STORE", "SAVE", "REPLAY", "COMMANDS", "FDIRECTORY", "CD", "FCOPY x =")


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("word", COMMANDS)
def test_no_line_leaves_its_folder(word: str, name: str, tmp_path: Path) -> None:
    r = defined(LOG)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if not path.is_symlink()}
    for ask in (r.do, r.prompt):
        with suppress(vrs.VrsError):
            assert "secret" not in ask(f"{word} {name}").text.replace(name, "")
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if not path.is_symlink()} == before


@pytest.mark.parametrize("name", OUTSIDE[:-1])
@pytest.mark.parametrize("word", ["FOPENR", "FOPENW", "FOPENA", "FDELETE"])
def test_no_program_leaves_its_folder(word: str, name: str, tmp_path: Path) -> None:
    r = defined(f'.PROGRAM leaves()\n    ATTACH (5)\n    {word} (5) "{name}"\n.END\n')
    run = r.execute("leaves", check=False)
    assert run.fault is not None
    assert run.fault.code == FileOutside.code
    assert (tmp_path / "secret.txt").read_text() == "secret\n"


def test_tasks_that_a_program_starts_have_its_folder() -> None:
    r = defined(".PROGRAM both()\n    EXECUTE 5 log()\n    WAIT.EVENT 0, 1\n.END\n", LOG)
    r.execute("both", folder="sub")
    assert Path("sub/log.txt").exists()
    assert Path("given.txt").exists()


def test_what_is_read_counts_as_memory() -> None:
    Path("big.txt").write_bytes(b"x" * 5000)
    r = defined('.PROGRAM reads()\n FOR i = 5 TO 8\n  ATTACH (i)\n  FOPENR (i) "big.txt"\n END\n.END\n')
    assert r.execute("reads", limits=vrs.Limits(max_elements=20_000)).ok
    with pytest.raises(vrs.ProgramFailed, match="files that are read hold 20000 characters, 19999 at most"):
        r.execute("reads", limits=vrs.Limits(max_elements=19_999))


# --- cells and signals ---


def test_signals_of_a_call_count_from_its_beginning() -> None:
    Path("signals.csv").write_text("2.5, 1001, ON\n3, 1001, OFF\n")
    for given in ([(2.5, 1001, True), (3.0, 1001, False)], "signals.csv"):
        r = defined(WAITS)
        r.move(10, -90, 90, 0, 0, 0)
        run = r.execute("waits", signals=given)  # type: ignore[arg-type]
        assert run.ended - run.started == pytest.approx(2.5)


def test_what_signals_of_a_call_have_not_done_does_not_happen() -> None:
    r = defined(WAITS)
    r.do("TYPE 1", signals=[(1.0, 1001, True)])
    with pytest.raises(vrs.ProgramFailed, match=r"signals= says when inputs change"):
        r.execute("waits")
    assert vrs.Robot(signals=[(1.0, 1001, True)]).do("WAIT SIG(1001)").ok


def test_signals_of_the_robot_come_beside_those_of_a_call() -> None:
    r = vrs.Robot(signals=[(1.0, 1002, True), (5.0, 1003, True)])
    r.do("WAIT SIG(1001)", signals=[(2.0, 1001, True)])
    assert (r["SIG(1002)"], r["SIG(1003)"]) == (-1.0, 0.0)
    r.do("WAIT SIG(1003)")
    assert r.now == 5.0


def test_signals_that_a_sensor_sets_are_refused(tmp_path: Path) -> None:
    cell = tmp_path / "gate.toml"
    cell.write_text('[[sensor]]\nname = "gate"\nkind = "beam"\nsignal = 1004\nfrom = [400, 0, 0]\nto = [400, 9, 0]\n')
    given = [(0.5, 1004, True)]
    with pytest.raises(IllegalSignal, match="a sensor of the cell sets it"):
        vrs.Robot(cell=cell, signals=given)
    r = defined(WAITS)
    with pytest.raises(IllegalSignal, match="a sensor of the cell sets it"):
        r.execute("waits", cell=cell, signals=given)
    r.do("SIGNAL 1004", cell=None)  # the cell of the refused call is gone
    assert r["SIG(1004)"] == -1.0


def test_a_cell_is_around_a_robot_or_a_call() -> None:
    own = vrs.Robot(cell="cell.toml")
    own.define(GOES)
    assert own.execute("goes").ended == pytest.approx(0.8)
    r = defined(GOES)
    assert r.execute("goes", cell="cell.toml").ended == pytest.approx(0.8)
    r.do("SIGNAL 3")  # nothing follows of it any more
    r.define(WAITS.replace("SIG(1001)", "NOT SIG(1001)"))
    with pytest.raises(vrs.ProgramFailed, match="waits for NOT SIG"):
        r.execute("waits")


# --- held in other ways ---


def test_a_loaded_trajectory_has_finite_limits_too(tmp_path: Path) -> None:
    vrs.Robot().move(10, -90, 90, 0, 0, 0).save(tmp_path / "t.vrst")
    r = vrs.load(tmp_path / "t.vrst", limits=FEW)
    r.define(EVER)
    with pytest.raises(vrs.ProgramFailed, match="1000 steps"):
        r.execute("ever")
    with pytest.raises(FileOutside):
        r.do("FLIST ../secret.txt")


def test_two_threads_have_their_own_folders() -> None:
    r = vrs.Robot()
    r.define("".join(LOG.replace("log", f"log{name}").replace(f"log{name}.txt", "log.txt") for name in "ab"))
    for name in "ab":
        Path(name).mkdir()
    done = [threading.Thread(target=r.execute, args=(f"log{name}",), kwargs={"folder": name}) for name in "ab"]
    for thread in done:
        thread.start()
    for thread in done:
        thread.join()
    assert Path("a/log.txt").exists()
    assert Path("b/log.txt").exists()


def test_a_served_robot_has_those_of_its_server(tmp_path: Path) -> None:
    with serving(tmp_path) as there, vrs.connect(there.address) as r:
        with pytest.raises(UsageError, match="has those of its server"):
            r.do("WHERE", limits=FEW)
        r.define(WAITS)
        assert r.do("WHERE").ok


def test_limit_reached_is_the_error_of_a_run() -> None:
    run = defined(EVER).execute("ever", check=False, limits=FEW)
    assert run.fault is not None
    assert run.fault.code == LimitReached.code


New = Callable[[], vrs.Robot]
READY = np.array([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
DOWN = (0, -45, 180, 0, 45, 0)


def circle(k: int) -> np.ndarray:
    return READY + np.array([20.0 * np.sin(0.02 * k), 10.0 - 10.0 * np.cos(0.02 * k), 0, 0, 0, 0])


def test_steering_follows_the_targets_and_rests_at_the_last(new: New) -> None:
    r = new()
    for k in range(100):
        r.steer(circle(k))
        if k > 10:
            assert np.abs(r.joints - circle(k)).max() < 0.5
    assert r.now == pytest.approx(2.0, abs=1e-6)
    assert np.abs(r.where(np.linspace(0.0, r.now, 400)).velocity).max() < 60.0, "it does not stop between targets"
    assert np.allclose(r.wait().joints, circle(99), atol=1e-9)
    assert [one.text for one in r.commands] == ["STEER"] * 3, "the first, those that follow, the last"


def test_steering_keeps_the_limits_of_the_robot(new: New) -> None:
    r = new()
    for k in range(60):
        r.steer(READY + np.array([100.0 * (k // 10 % 2), 0, 0, 0, 0, 0]), rate=100)
    r.wait()
    seen = r.sample(500)
    assert (np.abs(seen.velocity) <= r.model.max_velocity + 1e-6).all()
    assert (np.abs(seen.acceleration) <= r.model.max_acceleration + 1e-6).all()


def test_one_target_is_a_motion_there(new: New) -> None:
    r = new().steer(*DOWN).wait()
    assert r.joints.tolist() == pytest.approx(DOWN)
    assert len(r.commands) == 1


def test_a_target_takes_the_place_of_motions(new: New) -> None:
    r = new().move(*DOWN)
    r.steer(READY + 5.0).wait()
    assert np.allclose(r.joints, READY + 5.0)
    r.steer(READY)
    r.move(*DOWN).wait()
    assert r.joints.tolist() == pytest.approx(DOWN), "the target before is not gone to"


def test_steering_speaks_the_units_of_the_robot(new: New) -> None:
    r = new().in_units("SI")
    r.steer(np.radians(READY + 3.0), speed=50).wait()
    assert np.allclose(r.joints, np.radians(READY + 3.0))
    assert np.abs(r.sample().velocity).max() <= 0.5 * r.model.max_velocity.max()


def test_targets_need_not_be_waited_for(new: New) -> None:
    r = new()
    with r.without_waiting():
        for k in range(20):
            r.steer(circle(k))
    assert np.allclose(r.wait().joints, circle(19), atol=1e-9)
    with pytest.raises(JointOutOfRange), r.without_waiting():
        r.steer(999, 0, 0, 0, 0, 0)


def test_what_is_no_target_is_refused_and_ends_the_stream(new: New) -> None:
    r = new()
    r.steer(circle(1)).steer(circle(2))
    with pytest.raises(JointOutOfRange, match="Joint 1"):
        r.steer(200, 0, 0, 0, 0, 0)
    with pytest.raises(ValueError, match="shape"):
        r.steer(1, 2, 3)
    with pytest.raises(TypeError, match="drag takes a location"):
        r.steer(vrs.trans(0, 450, 0))
    for rate in (0.0, 1.0, 1001.0, inf):
        with pytest.raises(ValueError, match="rate"):
            r.steer(READY, rate=rate)
    with pytest.raises(ValueError, match="speed"):
        r.steer(READY, speed=101)
    with pytest.raises(TypeError, match="location: a Location is wanted"):
        r.drag(READY)


def test_who_stops_the_robot_is_not_steered_over(new: New) -> None:
    """A loop that goes on sending must not undo another user's stop."""
    r = new()
    r.steer(circle(1)).steer(circle(2))
    r.held.abort()  # as another thread or user does
    with pytest.raises(RequestRefused, match="something else has moved or stopped the robot"):
        r.steer(circle(3))
    r.steer(circle(4)).wait()
    assert np.allclose(r.joints, circle(4))
    r.steer(circle(5)).steer(circle(6)).abort().steer(circle(7)).wait()
    assert np.allclose(r.joints, circle(7)), "who stops it may go on"


def test_a_dragged_tool_follows_and_rests_at_the_last_target(new: New) -> None:
    r = new().move(*DOWN).wait()
    begin, since = r.where().location, r.now
    for k in range(50):
        held = r.drag(vrs.trans(k, 0, -k) @ begin)
        assert not held.held
    assert r.now == pytest.approx(since + 1.0, abs=1e-4)
    assert np.allclose(r.wait().where().xyz, begin.xyz + np.array([49, 0, -49]), atol=1e-3)
    assert [one.text for one in r.commands][-1] == "DRAG"
    r.undo()
    assert np.allclose(r.where(r.end).xyz, begin.xyz), "all of it is one command"


def test_a_matrix_is_a_target(new: New) -> None:
    r = new().move(*DOWN).wait()
    T = np.array(r.where().location.matrix)
    T[0, 3] += 0.02
    r.drag(T)
    assert np.allclose(r.wait().where().location.matrix, T, atol=1e-6)


def test_out_of_reach_the_tool_says_what_holds_it(new: New) -> None:
    r = new().move(*DOWN).wait()
    far = vrs.trans(2000, 0, 0) @ r.where().location
    for _ in range(300):
        held = r.drag(far)
    assert held.held
    assert held.limits == ("out of reach: too far",)
    assert held.distance == pytest.approx(float(np.linalg.norm(r.where().xyz - far.xyz)))
    assert repr(held).startswith("<Dragged: ")
    metres = r.in_units("SI").drag(far.matrix)
    assert metres.distance == pytest.approx(held.distance / 1000.0, rel=1e-3)
    r.wait()
    assert r.end <= r.now + 1e-9


def test_a_drag_begins_anew_after_other_motions_and_after_a_stop(new: New) -> None:
    r = new().move(*DOWN).wait()
    begin = r.where().location
    r.drag(vrs.trans(10, 0, 0) @ begin)
    r.move(*DOWN).wait()
    r.drag(vrs.trans(20, 0, 0) @ begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz + np.array([20, 0, 0]), atol=1e-3)
    r.drag(begin)
    r.held.abort()
    with pytest.raises(RequestRefused, match="the arm was let go: something else has moved or stopped the robot"):
        r.drag(begin)
    r.drag(begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz, atol=1e-3)
    r.drag(vrs.trans(20, 0, 0) @ begin)
    r.abort().drag(begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz, atol=1e-3)


def test_in_real_time_targets_take_their_time() -> None:
    r = vrs.Robot(realtime=20.0)
    since = r.now
    for k in range(100):
        r.steer(circle(k))
    assert r.now - since >= 1.98
    assert np.allclose(r.wait().joints, circle(99), atol=1e-9)
    begin = r.where().location
    for k in range(20):
        r.drag(vrs.trans(0, 0, -k) @ begin)
    assert np.allclose(r.wait().where().xyz, begin.xyz - [0, 0, 19], atol=1e-2)
