from __future__ import annotations

import csv
import io
from math import degrees
from pathlib import Path

import pytest

from tests.files.trajectories import initial, planned, puma
from vrs_cli.engine.position import position_at
from vrs_cli.errors import FileError
from vrs_cli.files.exports import CHUNK, EXPORTERS, export, sample_times, write_csv
from vrs_cli.kinematics.arm import arm_for
from vrs_cli.kinematics.transform import to_oat
from vrs_cli.trajectory.timeline import Timeline

ARM = arm_for(puma())


def rows_of(timeline: Timeline, rate: float) -> list[list[str]]:
    stream = io.BytesIO()
    write_csv(stream, ARM, timeline, rate)
    return list(csv.reader(io.StringIO(stream.getvalue().decode("ascii"))))


def test_the_columns_are_fixed() -> None:
    assert ",".join(rows_of(Timeline([initial()]), 10.0)[0]) == "t,jt1,jt2,jt3,jt4,jt5,jt6,x,y,z,o,a,t_angle"


def test_every_row_is_what_g_says_at_its_time() -> None:
    timeline, _ = planned(15)
    for row in rows_of(timeline, 13.0)[1:]:
        t, *numbers = map(float, row)
        position = position_at(ARM, timeline, t)
        T = position.T_world_tool
        expected = [degrees(q) for q in position.joints]
        expected += [1000.0 * x for x in (T.px, T.py, T.pz)]
        expected += [degrees(angle) for angle in to_oat(T)]
        assert numbers == pytest.approx(expected, abs=1e-9, rel=0.0)


def test_rows_go_from_the_start_by_one_period_to_the_exact_end() -> None:
    timeline, _ = planned(8)
    times = [float(row[0]) for row in rows_of(timeline, 50.0)[1:]]
    assert times[0] == timeline.start
    assert times[-1] == timeline.end
    assert times[:-1] == [k / 50.0 for k in range(len(times) - 1)]
    assert times[-2] < times[-1] <= times[-2] + 1 / 50.0


def test_a_robot_that_never_moved_is_one_row() -> None:
    assert len(rows_of(Timeline([initial()]), 100.0)) == 2


def test_chunks_join_without_seam() -> None:
    timeline, _ = planned(3)
    rate = 3.5 * CHUNK / timeline.end
    times = [t for chunk in sample_times(timeline, rate) for t in chunk.tolist()]
    assert max(len(chunk) for chunk in sample_times(timeline, rate)) <= CHUNK
    assert times[:-1] == [k / rate for k in range(len(times) - 1)]


def test_the_same_bytes_every_time() -> None:
    timeline, _ = planned(5)
    assert rows_of(timeline, 77.0) == rows_of(timeline, 77.0)


def test_there_is_no_minus_zero() -> None:
    timeline, _ = planned(15)
    assert not [cell for row in rows_of(timeline, 100.0) for cell in row if cell == "-0.000000000"]


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    timeline, _ = planned(2)
    export(EXPORTERS["csv"], str(path), io.BytesIO(), ARM, timeline, 10.0)
    assert path.read_text().count("\n") == len(rows_of(timeline, 10.0))
    with pytest.raises(FileError, match="no space left"):
        export(EXPORTERS["csv"], "/dev/full", io.BytesIO(), ARM, timeline, 10.0)


def test_minus_is_standard_output() -> None:
    output = io.BytesIO()
    export(EXPORTERS["csv"], "-", output, ARM, Timeline([initial()]), 10.0)
    assert output.getvalue().startswith(b"t,jt1,")
