"""Test the names of `import vrs_cli`: loaded late at run time, and in the stub for type checkers."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import vrs_cli as vrs

STUB = Path(vrs.__file__).with_suffix(".pyi")


def test_the_stub_says_what_there_is() -> None:
    said = {
        node.names[0].asname: node.module
        for node in ast.parse(STUB.read_text()).body
        if isinstance(node, ast.ImportFrom)
    }
    assert set(said) == {*vrs.__all__, "load_ipython_extension"}
    for name, home in said.items():
        found = getattr(vrs, str(name))
        assert getattr(found, "__module__", home) == home


def test_every_name_is_listed() -> None:
    assert set(vrs.__all__) <= set(dir(vrs))


def test_another_name_is_none() -> None:
    with pytest.raises(AttributeError, match="module 'vrs_cli' has no attribute 'Robott'"):
        _ = vrs.Robott  # type: ignore[attr-defined]


def test_nothing_is_loaded_before_it_is_asked_for() -> None:
    code = "import sys, vrs_cli; print(*(name for name in sys.modules if name.startswith(('vrs_cli.', 'numpy'))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["vrs_cli.version"]
