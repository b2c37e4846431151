from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Vrs


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
