from __future__ import annotations

from pathlib import Path

import pytest

from tests.files.trajectories import initial, planned, puma
from vrs_cli.errors import FileError, UsageError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.render.plots import check_plot, plot_curves, plot_trajectory
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import Curve, Plot

pytest.importorskip("matplotlib")


def test_a_robot_that_never_moved_can_be_drawn(tmp_path: Path) -> None:
    plot_trajectory(tmp_path / "t.svg", arm_for(puma()), Timeline([initial()]), "still")
    assert "still" in (tmp_path / "t.svg").read_text()


def test_every_joint_and_axis_has_its_name(tmp_path: Path) -> None:
    plot_trajectory(tmp_path / "T.SVG", arm_for(puma()), planned(3)[0], "three motions")
    picture = (tmp_path / "T.SVG").read_text()
    for name in ("JT1", "JT6", "X", "Z", "joints [deg]", "tool [mm]", "t [s]"):
        assert f">{name}<" in picture


def test_what_cannot_be_drawn_is_told_before(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"\.svg, \.png or \.pdf"):
        check_plot(tmp_path / "t.jpeg")
    with pytest.raises(FileError, match="there is no folder"):
        check_plot(tmp_path / "none" / "t.svg")


def test_curves_of_the_prompt_in_every_format(tmp_path: Path) -> None:
    flat = tuple(Curve(name, name, (0.0, 1.0)) for name in ("JT4", "JT6"))
    for suffix, begin in ((".svg", b"<?xml"), (".png", b"\x89PNG"), (".pdf", b"%PDF")):
        path = tmp_path / f"curves{suffix}"
        plot_curves(path, Plot("Joints", "deg", (0.0, 1.0), flat))
        first = path.read_bytes()
        assert first.startswith(begin)
        plot_curves(path, Plot("Joints", "deg", (0.0, 1.0), flat))
        assert path.read_bytes() == first
    assert (tmp_path / "curves.svg").read_text().count("stroke-dasharray") == 2  # of the second curve, and its name
