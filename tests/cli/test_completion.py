from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from vrs_cli.cli.commands import SUBCOMMANDS

TRIED = {  # words before the Tab key, and what completes the last of them
    "ch": ["check"],
    "check --fo": ["--format"],
    "run --robot plan": ["planar2", "planar3"],
    "check here/p": ["here/pick.v2"],
    "serve --ser": [],
    "export t --to np": ["npz"],
    "export --to m": ["mcap", "mp4"],
    "lab st": ["steer"],
    "lab steer --rel": ["--relative"],
}
COMPLETE = {
    "bash": 'source {file}; COMP_WORDS=(vrs {words}); COMP_CWORD={last}; _shtab_vrs; echo "${{COMPREPLY[@]}}"',
    "fish": 'source {file}; complete -C "vrs {words}" | string split -f1 \\t',
}


@pytest.mark.parametrize("words", TRIED)
@pytest.mark.parametrize("shell", COMPLETE)
def test_a_shell_completes_what_is_typed(vrs: Vrs, tmp_path: Path, shell: str, words: str) -> None:
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"there is no {shell}")
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "pick.v2").touch()
    script = tmp_path / f"vrs.{shell}"
    script.write_text(vrs("tools", "completion", shell).out)
    line = COMPLETE[shell].format(file=script, words=words, last=len(words.split()))
    done = subprocess.run([program, "-c", line], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.stdout.split() == TRIED[words], done.stderr


@pytest.mark.parametrize("shell", SUBCOMMANDS["tools completion"].options[0].choices)
def test_every_subcommand_is_there(vrs: Vrs, shell: str) -> None:
    ended = vrs("tools", "completion", shell)
    assert (ended.status, ended.err) == (0, "")
    assert all(word in ended.out for word in ("connect", "experiment", "select", "so100"))


def test_a_shell_that_is_not_known(vrs: Vrs) -> None:
    assert vrs("tools", "completion", "csh").err.startswith("vrs tools completion: SHELL: invalid choice: 'csh'")


def test_the_settings_and_their_file(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / "vrs" / "config.toml"
    assert vrs("tools", "config", "--path") == (0, f"{path}\n", "")
    first = vrs("tools", "config")
    assert first.status == 0
    assert first.out.startswith(f"# {path} (not there: these are the defaults)\nkeys = ")
    path.parent.mkdir()
    path.write_text(first.out.replace('"emacs" ', '"vi" '))
    assert 'keys = "vi"' in vrs("tools", "config").out
    path.write_text("colour = 3")
    assert vrs("tools", "config").status == 1
    assert vrs("tools", "config").err == f"vrs tools config: {path}: colour is no setting (did you mean colours?)\n"
