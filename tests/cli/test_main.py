from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import vrs_cli
from tests.cli.conftest import Vrs
from vrs_cli.cli import main as cli_main
from vrs_cli.cli.commands import GROUPS, SUBCOMMANDS
from vrs_cli.cli.main import BROKEN_PIPE, INTERNAL_ERROR, INTERRUPTED
from vrs_cli.errors import FileError, LocationOutOfRange
from vrs_cli.trajectory.laws import law

VRS = [sys.executable, "-m", "vrs_cli"]


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version(vrs: Vrs, option: str) -> None:
    compiled = "" if str(law.__file__).endswith(".py") else " (compiled)"
    assert vrs(option) == (0, f"vrs {vrs_cli.__version__}{compiled}\n", "")


def modules_of(*arguments: str) -> list[str]:
    """The modules that a process has loaded after this command, among the words of its output."""
    code = f"import sys; from vrs_cli.__main__ import main; main({[*arguments]}); print(*sys.modules)"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()


def test_the_version_imports_nearly_nothing() -> None:
    modules = modules_of("--version")
    for heavy in ("numpy", "lark", "rich", "msgspec", "prompt_toolkit", "importlib.metadata", "argparse", "re"):
        assert heavy not in modules


@pytest.mark.parametrize("subcommand", ["run", "check"])
def test_a_short_program_loads_no_module_that_it_does_not_need(subcommand: str) -> None:
    modules = modules_of(subcommand, "programs/hello.v2")
    own = (
        *("devices.device", "engine.reach", "engine.steering", "files.atomic", "files.disk", "files.store"),
        *("kinematics.formula", "language.compile.direct", "repl.piped"),
        *("values.hand", "values.reports", "values.world"),
    )
    for heavy in ("numpy", "lark", "rich", "heapq", "pathlib", "queue", *(f"vrs_cli.{name}" for name in own)):
        assert heavy not in modules


def test_functions_of_atexit_are_called_and_all_is_written_before_the_end() -> None:
    code = "import atexit, sys; from vrs_cli.__main__ import process; atexit.register(print, 'last'); process()"
    command = [sys.executable, "-c", code, "check", "nothing.v2"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (2, "last\n")
    assert ended.stderr.startswith("vrs check: ")


def test_the_end_waits_for_threads() -> None:
    code = """
import sys, time
from threading import Thread
from vrs_cli.__main__ import process
Thread(target=lambda: (time.sleep(0.2), print("done"))).start()
process()
"""
    command = [sys.executable, "-c", code, "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.endswith("done\n")


@pytest.mark.parametrize("encoding", ["ascii", "utf-16"])
def test_streams_and_files_are_utf_8_whatever_the_system_says(tmp_path: Path, encoding: str) -> None:
    lines = '$a = "größe ±"\r\nTYPE $a\r\nTYPE "\udcf6"\r\nSTORE a\r\n'.encode("utf-8", "surrogateescape")
    environment = {**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0", "LC_ALL": "C"}
    ended = subprocess.run(VRS, input=lines, capture_output=True, check=False, cwd=tmp_path, env=environment)
    assert ended.stdout.decode("utf-8") == "größe ±\n\N{REPLACEMENT CHARACTER}\na.v2 stored\n"
    assert (ended.returncode, ended.stderr) == (0, b"")
    assert b"\r" not in (tmp_path / "a.v2").read_bytes()
    assert "größe ±" in (tmp_path / "a.v2").read_text(encoding="utf-8")


ELSEWHERE = """
import pkgutil, signal, sys
for name in ("fcntl", "grp", "pwd", "resource"):
    sys.modules[name] = None
for name in ("SIGHUP", "SIGPIPE", "SIGWINCH", "SIGALRM", "SIGUSR1", "setitimer"):
    if hasattr(signal, name):
        delattr(signal, name)
import vrs_cli
for module in pkgutil.walk_packages(vrs_cli.__path__, "vrs_cli."):
    __import__(module.name)
for name in ("termios", "tty", "pty"):
    assert not any(name in vars(module) for key, module in sys.modules.items() if key.startswith("vrs_cli"))
"""


def test_no_module_needs_what_only_posix_has() -> None:
    ended = subprocess.run([sys.executable, "-c", ELSEWHERE], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_lists_every_subcommand(vrs: Vrs, option: str) -> None:
    ended = vrs(option)
    assert ended.status == 0
    for name, row in SUBCOMMANDS.items():
        assert f"vrs {name} {row.arguments}" in ended.out
    assert max(map(len, ended.out.splitlines())) <= 100


TREE = """
work: shell demo run convert check fmt
trajectories: view where replay export verify
class: learn grade class class token
many: serve connect body
more: robots lab experiment lab delay lab steer tools lsp tools completion tools config
"""
MOST_HELP_ROWS = 60
MOST_HELP_WORDS = 2800  # of all helps together


def test_the_tree_of_subcommands() -> None:
    assert "\n".join(f"{title}: {' '.join(rows)}" for title, rows in GROUPS.items()) == TREE.strip()


def test_helps_are_short(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    helps = [vrs("--help").out, *(vrs(*name.split(), "--help").out for name in SUBCOMMANDS)]
    assert max(text.count("\n") for text in helps) <= MOST_HELP_ROWS
    assert sum(len(text.split()) for text in helps) <= MOST_HELP_WORDS


@pytest.mark.parametrize("name", list(SUBCOMMANDS))
def test_every_subcommand_has_help(vrs: Vrs, name: str) -> None:
    for option in ("--help", "--help-all"):
        ended = vrs(*name.split(), option)
        assert ended.status == 0
        assert ended.out.startswith(f"usage: vrs {name}")
        assert not ended.err


def test_rare_options_are_in_help_all_alone(vrs: Vrs) -> None:
    assert "--max-elements" not in vrs("run", "--help").out
    assert "--max-elements" in vrs("run", "--help-all").out
    for name in SUBCOMMANDS:
        assert ("the arm stands on" in vrs(*name.split(), "--help-all").out) == (name == "robots")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["steer", "a.csv"], "vrs: vrs steer is now vrs lab steer"),
        (["put", "a.v2"], "vrs: vrs put is now vrs connect URL --put FILE"),
        (["lab"], "vrs: vrs lab what? (there is experiment, delay, steer)"),
        (["tools", "--help"], "vrs: vrs tools what? (there is lsp, completion, config)"),
        (["tools", "lps"], "vrs: unknown subcommand tools lps (there is lsp, completion, config)"),
        (["connect", "ws://127.0.0.1", "--as", "a.v2"], "vrs connect: --as is for --put"),
        (["connect", "ws://127.0.0.1", "--replace"], "vrs connect: --replace is for --put and --get"),
        (["rnu"], "vrs: unknown subcommand rnu (did you mean run?)"),
        (["execute", "ok.v2"], "vrs: unknown subcommand execute (did you mean vrs run ok.v2?)"),
        (["LINT"], "vrs: unknown subcommand LINT (did you mean vrs check?)"),
        (["load", "ok.v2"], "vrs: unknown subcommand load (did you mean vrs shell ok.v2?)"),
        (["run", "ok.v2", "-o", "out.csv"], "vrs run: unknown option -o (did you mean --csv out.csv?)"),
        (["run", "ok.v2", "--output", "a.PNG"], "vrs run: unknown option --output (did you mean --plot a.PNG?)"),
        (["check", "ok.v2", "-o", "out.csv"], "vrs check: unknown option -o (see vrs check --help)"),
        (["run", "s.py"], "vrs run: s.py is a Python program, no VAL-II program (python s.py runs it)"),
        (["run", "a.v2", "d.csv"], "vrs run: d.csv is a table, no VAL-II program (vrs lab steer d.csv follows joints"),
        (["run", "t.vrst"], "vrs run: t.vrst is a trajectory, no VAL-II program (vrs replay t.vrst plays it)"),
        (["zzz"], "vrs: unknown subcommand zzz (see vrs --help)"),
        (["a/T.VRST"], "vrs replay: *Nonexistent file* a/T.VRST"),
        (["--vresion"], "vrs: unknown option --vresion"),
        (["run"], "vrs run: the following arguments are required: FILE.v2"),
        (["run", "--sav", "x", "y.v2"], "vrs run: unknown option --sav (did you mean --save?)"),
        (
            ["run", "a.v2", "--speed", "50"],
            "vrs run: unknown option --speed (SPEED 50 in the program sets the",
        ),
        (["run", "a.v2", "p", "q"], "vrs run: p is no program file"),
        (["export", "t.vrst", "--rate", "fast"], "vrs export: --rate: 'fast' is not a number"),
        (["export", "t.vrst", "--rate", "0"], "vrs export: --rate: 0 is not above 0"),
        (["export", "t.vrst", "--rate", "1e9"], "vrs export: --rate: 1e9 Hz is more than 100000 Hz"),
        (["where", "t.vrst", "--at", "nan"], "vrs where: --at: 'nan' is not a number"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_status_2(vrs: Vrs, arguments: list[str], told: str) -> None:
    ended = vrs(*arguments)
    assert ended.status == 2
    assert not ended.out
    assert ended.err.startswith(told)
    assert ended.err.count("\n") == 1


# --- what becomes of exceptions ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "status", "told"),
    [
        (KeyboardInterrupt(), INTERRUPTED, "vrs where: interrupted\n"),
        (LocationOutOfRange("x"), 1, "vrs where: *Location out of range* x\n"),
        (FileError("t"), 2, "vrs where: *File error* t\n"),
        (OSError(28, "No space left on device"), 1, "vrs where: standard output cannot be written: No space"),
    ],
)
def test_an_exception_is_one_line(
    vrs: Vrs, monkeypatch: pytest.MonkeyPatch, error: BaseException, status: int, told: str
) -> None:
    def broken(*_: object) -> int:
        raise error

    monkeypatch.setattr(cli_main, "_subcommand", broken)
    monkeypatch.setattr(cli_main, "_abandon_output", lambda: None)
    ended = vrs("where")
    assert ended.status == status
    assert ended.err.startswith(told)


def test_an_internal_error_leaves_its_traceback_in_a_file(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> int:
        raise ZeroDivisionError("ours")

    monkeypatch.setattr(cli_main, "_subcommand", broken)
    ended = vrs("where")
    assert ended.status == INTERNAL_ERROR
    assert ended.err.startswith("vrs where: internal error: ZeroDivisionError: ours; please report it with ")
    report = Path(ended.err.split()[-1])
    assert "in broken" in report.read_text()
    report.unlink()


def test_a_reader_that_leaves_early_is_no_error(saved: Path) -> None:
    arguments = [*VRS, "export", str(saved), "--to", "csv", "--rate", "20000"]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdout.readline().startswith(b"t,jt1")
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait() == BROKEN_PIPE
    process.stderr.close()


def test_a_full_disk_behind_standard_output_is_told(saved: Path) -> None:
    with open("/dev/full", "w") as full:
        ended = subprocess.run([*VRS, "where", saved, "--at", "1"], stdout=full, stderr=subprocess.PIPE, check=False)
    assert ended.returncode == 1
    assert ended.stderr == b"vrs where: standard output cannot be written: No space left on device\n"
