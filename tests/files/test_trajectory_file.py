from __future__ import annotations

import json
import re
from contextlib import nullcontext
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.files.journals import Kept
from tests.files.trajectories import appended, deltas, form, initial, planned, puma, without_checksums
from vrs_cli.engine.position import joints_at
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files.trajectory_file import read_trajectory, write_trajectory
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.trajectory.laws.law import VERSION
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Motion
from vrs_cli.version import __version__
from vrs_cli.wire.lines import Checksums, LineEncoder, decode_delta
from vrs_cli.wire.records import MotionRecord, Motions


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], planned(6)[1])
    return path


def edited(path: Path, line: int, old: str, new: str) -> Path:
    """The file with one line changed (counted from 1), and without checksums."""
    lines = without_checksums(path).read_text(encoding="utf-8").split("\n")
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1)
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


# --- laws --------------------------------------------------------------------------------------------------


@examples(60)
@given(st.lists(deltas, min_size=1, max_size=3))
def test_decoding_an_encoded_delta_gives_it_back_to_the_bit(given_deltas: list) -> None:
    written, read, checksums = LineEncoder(), Motions(), Checksums()
    for delta in given_deltas:
        line = written.delta(delta)
        again = decode_delta(checksums.open(line), read, form())
        assert repr(again) == repr(delta)  # repr tells -0.0 from 0.0, == does not
        assert line.count(b"\n") == 1


def test_reading_gives_the_deltas_and_the_timeline_they_make(tmp_path: Path) -> None:
    timeline, changes = planned(60)
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], changes)
    recording = read_trajectory(path)
    assert recording.deltas == changes
    assert recording.timeline == timeline
    assert recording.timeline.version == timeline.version
    assert recording.model == puma()
    assert tuple(recording.initial) == (initial(),)
    assert not recording.dropped_tail


def test_the_same_trajectory_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_trajectory(tmp_path / name, puma(), [initial()], planned(12)[1])
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_what_was_read_is_written_with_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    recording = read_trajectory(saved)
    again = tmp_path / "again.vrst"
    write_trajectory(again, recording.model, recording.initial, recording.deltas)
    assert again.read_bytes() == saved.read_bytes()


def test_a_file_cut_at_any_byte_loses_the_torn_line_only(tmp_path: Path) -> None:
    changes = planned(3, seed=4)[1]
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], changes)
    data = path.read_bytes()
    header = data.index(b"\n")
    ends = [at for at, one in enumerate(data) if one == ord("\n")]
    for size in range(len(data)):
        if size % 37 and min(abs(size - end) for end in ends) > 4:
            continue
        path.write_bytes(data[:size])
        if size < header:
            with pytest.raises(FileDamaged):
                read_trajectory(path)
            continue
        recording = read_trajectory(path)
        whole = data[:size].count(b"\n") - 1 + (data[size : size + 1] == b"\n")
        assert recording.deltas == changes[: max(whole, 0)]
        torn = data[size - 1 : size] != b"\n" and data[size : size + 1] != b"\n"
        assert recording.dropped_tail == torn


def test_a_motion_is_described_once(saved: Path) -> None:
    text = saved.read_text(encoding="utf-8")
    for delta in read_trajectory(saved).deltas:
        assert text.count(json.dumps(delta.motion.text, ensure_ascii=False)) == 1


# --- writing and reading ----------------------------------------------------------------------------------


def test_progress_goes_from_nothing_to_all(tmp_path: Path) -> None:
    path, shares = tmp_path / "t.vrst", list[float]()
    write_trajectory(path, puma(), [initial()], appended(1200))
    read_trajectory(path, shares.append)
    assert len(shares) == 3
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < 0.01
    assert 0.8 < shares[-1] <= 1.0


def test_a_failed_save_leaves_the_old_file(saved: Path) -> None:
    before = saved.read_bytes()

    def broken():
        yield planned(2)[1][0]
        raise RuntimeError("the disk caught fire")

    with pytest.raises(RuntimeError):
        write_trajectory(saved, puma(), [initial()], broken())
    assert saved.read_bytes() == before
    assert [entry.name for entry in saved.parent.iterdir()] == [saved.name]


# --- checksums ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda lines: [*lines[:2], lines[2].replace(b"1", b"2", 1), *lines[3:]], 3),
        (lambda lines: [*lines[:2], lines[2].replace(b'"text":"M', b'"text":"N'), *lines[3:]], 3),
        (lambda lines: [*lines[:2], *lines[3:]], 3),
        (lambda lines: [*lines[:3], *lines[2:]], 4),
        (lambda lines: [*lines[:2], lines[3], lines[2], *lines[4:]], 3),
        (lambda lines: [lines[0].replace(b'"title":"U', b'"title":"V'), *lines[1:]], 1),
        (lambda lines: [*lines[:2], lines[2].replace(b",", b", ", 1), *lines[3:]], 3),
        (lambda lines: [*lines[:2], lines[2][:-19] + b"}\n", *lines[3:]], 3),
    ],
    ids=["number", "text", "dropped", "doubled", "swapped", "header", "blank", "checksum"],
)
def test_a_line_that_was_not_written_there_is_refused(saved: Path, change, line: int) -> None:
    saved.write_bytes(b"".join(change(saved.read_bytes().splitlines(keepends=True))))
    with pytest.raises(FileDamaged, match=f"line {line}: its checksum does not fit"):
        read_trajectory(saved)


def test_a_file_without_checksums_is_read(saved: Path) -> None:
    assert without_checksums(saved).read_bytes().count(b'"crc"') == 0
    assert read_trajectory(saved).deltas == planned(6)[1]


def test_a_file_of_before_is_read_to_the_bit(tmp_path: Path) -> None:
    before = Path(__file__).with_name("without_checksums.vrst")
    recording, again = read_trajectory(before), tmp_path / "again.vrst"
    assert recording.warnings == ()
    write_trajectory(again, recording.model, recording.initial, recording.deltas)
    written = re.sub(rb',"events":\{([^{}]|\{[^{}]*\})*\}', b"", without_checksums(again).read_bytes())
    written = written.replace(b',"laws":2}', b"}", 1).replace(f'"vrs":"{__version__}"'.encode(), b'"vrs":"0.1.0"', 1)
    assert written == before.read_bytes()  # except the hand, which is a channel now
    assert read_trajectory(again).timeline == recording.timeline


def test_a_motion_of_earlier_laws_goes_as_it_did() -> None:
    """An SCURVE motion at SPEED 20 that interrupts another, which no law of today plans so."""
    recording = read_trajectory(Path(__file__).with_name("laws_1.vrst"))
    assert (recording.laws, recording.warnings) == (1, ())
    assert len(recording.timeline) == 9
    assert recording.timeline.end == 2.850605190731585
    assert joints_at(arm_for(recording.model), recording.timeline, 0.5) == (
        0.14512864247269225,
        -1.4450610675606408,
        1.4846894386827305,
        0.1373081992332564,
        0.08707718548361536,
        -0.2902572849453845,
    )


def test_a_file_says_which_laws_planned_its_motions(saved: Path) -> None:
    assert read_trajectory(saved).laws == VERSION


# --- files that are not what they should be ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "no whole first line"),
        (b"\n", "line 1: no header"),
        (b"\x00\xff\xfe junk", "no whole first line"),
        (b"\x89PNG\r\n\x1a\n\x00\x00\n", "line 1: no header"),
        (b".PROGRAM pick\n.END\n", "line 1: no header"),
        (b'{"type":"FeatureCollection"}\n', "line 1: no header"),
        (b"[" * 100_000 + b"\n", "line 1: no header"),
        (b'{"vrst":2,"vrs":"9.1"}\n', "line 1: version 2 of the file format of vrs 9.1"),
        (b'{"vrst":1}\n', "line 1: Object missing required field `vrs`"),
    ],
)
def test_a_foreign_file_is_refused_by_name(tmp_path: Path, data: bytes, told: str) -> None:
    path = tmp_path / "foreign.vrst"
    path.write_bytes(data)
    with pytest.raises(FileDamaged) as caught:
        read_trajectory(path)
    assert str(path) in str(caught.value)
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("line", "old", "new", "told"),
    [
        (1, '"puma560"', "7", "robot: name"),
        (1, '"initial":[', '"initial":[],"other":[', "line 1: the initial timeline has no segment"),
        (3, '"version":1', '"version":2', "line 3: a delta of timeline version 2; version 1 is due here"),
        (3, '"keep":', '"keep":99', "line 3: keeps"),
        (3, '"segments":', '"segmenst":', "line 3: Object"),
        (3, '"phase":"', '"phase":"very', "line 3: Invalid enum value 'very"),
        (3, '{"version"', "{version", "line 3: JSON is malformed"),
        (3, '"motion":{', '"motion":77,"extra":{', "line 3: Object contains unknown field `extra`"),
        (2, '"issued":', '"issued":1e999,"x":', "line 2: "),
    ],
)
def test_a_damaged_line_is_named_with_its_reason(saved: Path, line: int, old: str, new: str, told: str) -> None:
    with pytest.raises(FileDamaged) as caught:
        read_trajectory(edited(saved, line, old, new))
    assert told in str(caught.value)


def damaged_record(path: Path, change) -> Path:
    """The file with the record of line 2 changed by `change`, and without checksums."""
    lines = without_checksums(path).read_text(encoding="utf-8").split("\n")
    record = json.loads(lines[1])
    change(record)
    lines[1] = json.dumps(record)
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda r: r.update(motion=5), "motion 5 is referred to but not described"),
        (lambda r: r.update(keep=0, drop=1, segments=[]), "leaves a timeline without segments"),
        (lambda r: r["segments"][0].update(start=90.0, finish=91.0), "the segments overlap in time"),
        (lambda r: r["segments"][0].update(start=1.0, finish=0.5), "finishes at 0.5 s, before it starts"),
        (lambda r: r["segments"][0].pop("joints"), "a segment needs either joints or line"),
        (lambda r: r["segments"][0]["joints"].pop(), "5 joint values for a robot of 6 joints"),
        (lambda r: r["segments"][0]["joints"].insert(0, []), "Expected `array` of length >= 1"),
    ],
)
def test_a_record_that_cannot_be_is_refused(tmp_path: Path, change, told: str) -> None:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], appended(2))
    with pytest.raises(FileDamaged, match=r"line 2: ") as caught:
        read_trajectory(damaged_record(path, change))
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"speed": 0.0}, "Expected `float` > 0.0 - at `$.motion.speed`"),
        ({"speed": 1.5}, "Expected `float` <= 1.0 - at `$.motion.speed`"),
        ({"acceleration": 0.0}, "Expected `float` > 0.0 - at `$.motion.acceleration`"),
        ({"duration": -7.0}, "Expected `float` >= 0.0 - at `$.motion.duration`"),
        ({"duration": 1e300}, "Expected `float` <= 4194304.0 - at `$.motion.duration`"),
        ({"goal": None}, "a motion of kind joint needs a goal"),
        ({"kind": "steered", "goal": None}, "a motion of kind steered needs a goal"),
        ({"kind": "straight"}, "a motion of kind straight needs a pose"),
    ],
)
def test_a_motion_that_could_not_be_planned_again_is_refused(tmp_path: Path, change, told: str) -> None:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], appended(2))
    with pytest.raises(FileDamaged, match=r"line 2: ") as caught:
        read_trajectory(damaged_record(path, lambda record: record["motion"].update(change)))
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda r: r["segments"][0]["joints"][2].append(0.0), "polynomials of 3 and of 4 coefficients"),
        (lambda r: r["segments"][0]["joints"][2].extend([0.0] * 9), "Expected `array` of length <= 6"),
        (lambda r: r["segments"][0]["joints"][2].__setitem__(0, 1e308), "Expected `float` <= 1000000000000000.0"),
        (lambda r: r["segments"][0].update(start=1e-10), "no multiple of 2^-30 s"),
        (lambda r: r.update(cut=1e12), "Expected `float` <= 8388608.0"),
        (lambda r: r.update(motion=10**400), "line 2: "),
    ],
)
def test_a_form_that_no_robot_has_is_refused(tmp_path: Path, change, told: str) -> None:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], appended(2))
    for lenient in (False, True):
        with pytest.raises(FileDamaged, match=r"line 2: ") if not lenient else nullcontext() as caught:
            recording = read_trajectory(damaged_record(path, change), lenient=lenient)
        if lenient:
            assert not recording.deltas
            assert any("left out" in warning for warning in recording.warnings)
        else:
            assert told in str(caught.value)


# --- laws of motion ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda r: r["segments"][0]["joints"][2].__setitem__(0, 2.0), "line 2: joint 3 jumps by 35.4084 deg, 0.000 s"),
        (lambda r: r["segments"][0]["joints"][2].__setitem__(1, 0.5), "line 2: "),
        (lambda r: r["motion"]["goal"].__setitem__(4, 7.0), "line 2: the goal of joint 5, 401.07 deg, is beyond"),
    ],
)
def test_a_jump_is_a_warning_in_a_file_of_before_and_refused_in_others(tmp_path: Path, change, told: str) -> None:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], appended(2))
    recording = read_trajectory(damaged_record(path, change))
    assert told in recording.warnings[0]
    sealed(path)
    with pytest.raises(FileDamaged, match=r"t\.vrst, line ") as caught:
        read_trajectory(path)
    assert recording.warnings[0] in str(caught.value)
    assert read_trajectory(path, lenient=True).warnings == recording.warnings


def sealed(path: Path) -> None:
    """Give every line of a file the checksum that fits it."""
    checksums, lines = Checksums(), path.read_bytes().splitlines()
    path.write_bytes(b"".join(checksums.seal(line) + b"\n" for line in lines))


def test_a_damaged_first_line_has_nothing_before_it(saved: Path) -> None:
    with pytest.raises(FileDamaged, match="line 1: 5 joint values") as caught:
        read_trajectory(edited(saved, 1, '"joints":[[0.0],', '"joints":['))
    assert "before that line" not in str(caught.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile, match="nowhere"):
        read_trajectory(tmp_path / "nowhere.vrst")
    with pytest.raises(FileError, match="is a folder"):
        read_trajectory(tmp_path)


@pytest.mark.parametrize("place", ["file/t.vrst", "missing/t.vrst", "folder"])
def test_an_unwritable_place_is_one_clear_error(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    with pytest.raises(FileError, match=place):
        Kept.new(tmp_path / place)
    with pytest.raises(FileError, match=place):
        write_trajectory(tmp_path / place, puma(), [initial()], ())
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
def test_a_full_disk_is_a_file_error() -> None:
    with pytest.raises(FileError, match=r"/dev/full cannot be written: no space left"):
        write_trajectory("/dev/full", puma(), [initial()], ())
    with pytest.raises(FileError, match=r"/dev/full cannot be written: no space left"):
        Kept.new(Path("/dev/full"))
    assert Path("/dev/full").is_char_device()


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="there are no devices with a path")
def test_a_device_is_written_and_stays_a_device() -> None:
    kept = Kept.new(Path("/dev/null"))
    kept.happen(appended(1)[0])
    kept.journal.close()
    assert Path("/dev/null").is_char_device()


def test_an_old_timeline_is_equal_to_one_applied_step_by_step(saved: Path) -> None:
    recording = read_trajectory(saved)
    timeline = Timeline(recording.initial)
    for delta in recording.deltas:
        timeline = timeline.apply(delta)
    assert timeline == recording.timeline


@examples(150)
@given(place=st.floats(0.0, 1.0, exclude_max=True), junk=st.binary(max_size=6), cut=st.integers(0, 40))
def test_any_damage_is_a_file_damaged_or_still_a_trajectory(
    tmp_path: Path, place: float, junk: bytes, cut: int
) -> None:
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], appended(3))
    data = path.read_bytes()
    at = int(place * len(data))
    path.write_bytes(data[:at] + junk + data[at + cut :])
    try:
        recording = read_trajectory(path)
    except FileDamaged:
        return
    assert len(recording.timeline) >= 1


def test_every_field_of_a_motion_is_written() -> None:
    assert set(Motion.__struct_fields__) == set(MotionRecord.__struct_fields__)
