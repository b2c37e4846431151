"""`vrs lab experiment delays`: tables, JSON and pictures; what is wrong with its options is told."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vrs_cli.cli.main import run

SHORT = ("lab", "experiment", "delays", "--seeds", "2", "--seconds", "10")
SHORTEST = ("lab", "experiment", "delays", "--seeds", "1", "--seconds", "5", "--rate", "2", "--jobs", "1")


def out_of(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> str:
    assert run(arguments) == status
    taken = capsys.readouterr()
    return taken.err if status else taken.out


def test_the_tables_have_a_row_for_each_lead_and_policy(capsys: pytest.CaptureFixture[str]) -> None:
    text = out_of(capsys, *SHORTEST)
    assert text.startswith("Gamma 200ms 80ms each way; 1 x 5 s, 5 commands each\nMeasured: D_f + D_b is 0.")
    for policy in ("ABORT", "POSTPONE"):
        rows = [line.split()[1] for line in text.splitlines() if line.startswith(policy)]
        assert rows == ["0", "0.2", "0.4", "0.6", "0.8"] * 3
    assert "ABORT          0           -           -           -           -           -" in text, "nothing moved"
    assert text.endswith(
        "The flagged times are those of the logs of both sides (10 trials)\n"
        "At all other times the error of deltas is at most 0 deg, 0 mm\n"
    )


def test_processes_change_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    some = (*SHORTEST, "--seeds", "2", "--lead", "200ms", "--policy", "abort")
    assert out_of(capsys, *some, "--jobs", "2") == out_of(capsys, *some, "--jobs", "1")


def test_delays_and_jitters_are_swept(capsys: pytest.CaptureFixture[str]) -> None:
    few = ("--lead", "0.1", "--policy", "POSTPONE", "--loss", "2%", "--robot", "cobra600")
    text = out_of(capsys, *SHORTEST, "--delay", "50ms", "0.1", "--jitter", "0", "20ms", *few)
    heads = [line.split(";")[0] for line in text.splitlines() if line.startswith("Gamma")]
    assert heads == [
        *("Gamma 50ms 0ms each way, loss 2.0%", "Gamma 50ms 20ms each way, loss 2.0%"),
        *("Gamma 100ms 0ms each way, loss 2.0%", "Gamma 100ms 20ms each way, loss 2.0%"),
    ]


def test_json_has_all_figures(capsys: pytest.CaptureFixture[str]) -> None:
    some = ("--forward", "constant 100ms", "--lead", "0", "0.3", "--policy", "ABORT", "--json", "--jobs", "1")
    found = json.loads(out_of(capsys, *SHORT, *some))
    assert (found["seeds"], found["seconds"], found["rate"]) == (2, 10.0, 25.0)
    none, all_in_time = found["rows"]
    assert none["delays"] == "Forward constant 100ms, backward 0"
    assert none["errors"] is None
    assert none["aborted"] == none["commands"]
    assert (all_in_time["lead_s"], all_in_time["aborted"], all_in_time["postponed"]) == (0.3, 0, 0)
    assert all_in_time["round_trip_s"] == {"median": pytest.approx(0.1), "95": pytest.approx(0.1)}
    assert all_in_time["flags_agree"] is True
    assert all_in_time["unflagged_error"] == {"max_deg": 0.0, "max_mm": 0.0}
    assert all_in_time["errors"]["preview"] == {"mean_deg": 0.0, "max_deg": 0.0, "mean_mm": 0.0, "max_mm": 0.0}
    assert {*all_in_time["errors"]} == {"frames", "predicted", "deltas", "ahead", "preview"}


def test_curves_are_drawn_in_letters(capsys: pytest.CaptureFixture[str]) -> None:
    leads = ("--lead", "0.4", "0.1", "0.2", "--policy", "POSTPONE", "--jobs", "1")
    text = out_of(capsys, *SHORT, *leads, "--plot")
    assert "Mean error over the lead, POSTPONE, Gamma 200ms 80ms each way [deg]" in text
    assert "0.10       0.15      0.20" in text


@pytest.mark.parametrize("policies", [("POSTPONE",), ("ABORT", "POSTPONE")])
def test_curves_are_drawn_into_a_picture(
    policies: tuple[str, ...], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "delays.svg"
    out_of(capsys, *SHORTEST, "--lead", "0.6", "0.8", "--policy", *policies, "--plot", str(picture))
    text = picture.read_text()
    assert "lead [s]" in text
    for policy in policies:
        assert f"{policy}, Gamma 200ms 80ms each way [deg]" in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "which experiment? (one of delays, methods"),
        (("jitter",), "EXPERIMENT: invalid choice: 'jitter'"),
        (("delays", "--forward", "gama 1 2"), "--forward: 'gama 1 2' is no kind of delays; did you mean gamma?"),
        (("delays", "--lead", "soon"), "--lead: 'soon' is no duration; as 200ms, 0.2s or 0.2"),
        (("delays", "--loss", "60%"), "--loss: '60%' is no share that may be lost; from 0 to 50%"),
        (("delays", "--delay", "1", "--forward", "1"), "--delay and --jitter are of both ways"),
        (("delays", "--policy", "WAIT"), "--policy: invalid choice: 'WAIT'"),
        (("delays", "--plot", "picture.gif"), "picture.gif is no picture file"),
        (("delays", "--forward", "trace nowhere"), "--forward: nowhere cannot be read: No such file or directory"),
        (("delays", "--seeds", "0"), "--seeds: 0 is not above 0"),
        (("delays", "--seconds", "1"), "--seconds: 1 s is not from 5 to 10000 s"),
        (("delays", "--rate", "1e9"), "--rate: 1e+09 Hz is not from 1 to 200 Hz"),
    ],
)
def test_what_is_wrong_is_told(arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert said in out_of(capsys, "lab", "experiment", *arguments, status=2)


def test_one_lead_is_no_curve(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "delays.png"
    out = out_of(capsys, *SHORTEST, "--lead", "0.2", "--plot", str(picture), status=2)
    assert "a curve needs two leads" in out
    assert not picture.exists()


# --- methods ---------------------------------------------------------------------------------------------------------

METHODS = ("lab", "experiment", "methods", "--seeds", "2", "--seconds", "5", "--rate", "10")
MINE = str(Path(__file__).parents[2] / "examples" / "10_predictor.py") + ":DoubleExponential"


def test_methods_are_told_in_one_table(capsys: pytest.CaptureFixture[str]) -> None:
    text = out_of(capsys, *METHODS, "--viewer", MINE, "--scenario", "waves", "moves", "--jobs", "2")
    rows = [tuple(line.split()[:2]) for line in text.splitlines() if line.startswith(("waves ", "moves "))]
    viewers = ("frames", "extrapolated", "DoubleExponential", "timeline")
    assert rows == [(s, v) for s in ("waves", "moves") for v in viewers] + [
        ("waves", c) for c in ("direct", "ahead", "wait")
    ]


def test_methods_as_json_have_all_figures(capsys: pytest.CaptureFixture[str]) -> None:
    some = ("--viewer", MINE, "--scenario", "waves", "--forward", "100ms", "--json", "--jobs", "1")
    found = json.loads(out_of(capsys, *METHODS, *some))
    assert [row["scenario"] for row in found["rows"]] == ["waves"]
    assert {*found["rows"][0]["viewers"]} == {"frames", "extrapolated", "timeline", MINE}
    assert found["rows"][0]["controllers"]["direct"]["lag"] >= 0.1


def test_a_class_alone_is_tried(capsys: pytest.CaptureFixture[str]) -> None:
    text = out_of(capsys, "lab", "experiment", "--viewer", MINE, *METHODS[3:], "--scenario", "stops", "--jobs", "1")
    assert "DoubleExponential" in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--viewer", "nowhere.py:Mine"), "nowhere.py is not there"),
        (("--viewer", "vrs_cli.lab.methods:Nothing"), "has no class Nothing"),
        (("--controller", "direkt"), "'direkt' is no class"),
        (("--scenario", "wave"), "--scenario: no scenario is wave (did you mean waves?)"),
        (("--lead", "0.2"), "--lead is of vrs lab experiment delays"),
    ],
)
def test_what_is_wrong_with_methods_is_told(
    arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in out_of(capsys, *METHODS, *arguments, status=2)


def test_a_class_that_fails_in_another_process_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(
        "import vrs_cli as vrs\nclass Mine(vrs.Predictor):\n"
        "    def receive(self, t, joints): raise KeyError('x')\n    def predict(self, t): return 0\n"
    )
    said = out_of(capsys, *METHODS, "--viewer", f"{path}:Mine", "--jobs", "2", status=2)
    assert (
        said == f"vrs lab experiment: *Cannot be tried* {path}:Mine: receive(0.000) raised KeyError: 'x' (mine.py:3)\n"
    )


# --- twin ------------------------------------------------------------------------------------------------------------

TWIN = (
    "lab",
    "experiment",
    "twin",
    "--robot",
    "ur5e",
    "--seeds",
    "1",
    "--seconds",
    "6",
    "--lead",
    "0.6",
    "--jobs",
    "1",
)


def test_a_twin_is_told_and_drawn(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    storm, picture = tmp_path / "storm.toml", tmp_path / "twin.svg"
    storm.write_text("[[block]]\nat = 2.0\njoint = 1\n")
    text = out_of(capsys, *TWIN, "--scenario", "healthy", str(storm), "--plot", str(picture))
    assert [line.split()[0] for line in text.splitlines() if " ABORT " in line] == ["healthy", "storm.toml"] * 2
    assert text.endswith("Outside flagged times the error of timeline, minus that of tracking, is at most 0 deg\n")
    assert "storm.toml, lead 0.6 s, ABORT: error [deg]" in picture.read_text()
    found = json.loads(out_of(capsys, *TWIN, "--scenario", "healthy", "--json"))
    assert found["rows"][0]["excess"] == 0.0
    assert found["rows"][0]["alarm"] is None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenario", "helthy"), "--scenario: no scenario is helthy (did you mean healthy?)"),
        (("--scenario", "nowhere.toml"), "nowhere.toml"),
        (("--plot", "twin.png"), "--plot of twin wants a picture (--plot OUT.svg)"),
        (("--plot", "nowhere/twin.svg"), "nowhere"),
        (("--rate", "10"), "--rate is of vrs lab experiment delays and methods (leave it out)"),
    ],
)
def test_what_is_wrong_with_a_twin_is_told(
    arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in out_of(capsys, *TWIN, *arguments, status=2)


# --- study -----------------------------------------------------------------------------------------------------------


def test_a_study_goes_on_where_it_was(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.toml").write_text("trials = 1\n[[condition]]\nname = 'a'\n[[condition]]\nname = 'b'\nforward = '200ms'\n")
    dry = ("lab", "experiment", "study", "s.toml", "--dry-run")
    assert out_of(capsys, *dry).startswith("P001: 2 of 2 trials to do; results: s.dry.csv\n")
    rows = Path("s.dry.csv").read_text().splitlines(keepends=True)
    Path("s.dry.csv").write_text("".join(rows[:-1]) + rows[-1][:9])
    assert out_of(capsys, *dry).startswith("P001: 1 of 2 trials to do")
    assert out_of(capsys, *dry).startswith("P002: 2 of 2 trials to do")
    found = json.loads(out_of(capsys, *dry, "--participant", "2", "--json"))
    assert [(row["condition"], row["trials"], row["reached"]) for row in found["rows"]] == [
        ("a", 2, 1.0),
        ("b", 2, 1.0),
    ]
    assert "which study?" in out_of(capsys, "lab", "experiment", "study", status=2)
    assert "nowhere.toml" in out_of(capsys, "lab", "experiment", "study", "nowhere.toml", status=2)
    assert "--dry-run is of vrs lab experiment study" in out_of(
        capsys, "lab", "experiment", "delays", "--dry-run", status=2
    )
    assert "one argument too many: s.toml" in out_of(capsys, "lab", "experiment", "delays", "s.toml", status=2)
