"""Test the formulas of EXPLAIN: each printed formula gives the printed value."""

from __future__ import annotations

import re
from math import acos, atan2, copysign, cos, pi, sin, sqrt
from random import Random

import pytest

from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.render.symbols import FAMILIES, latex, latex_name

FUNCTIONS = {"acos": acos, "atan2": atan2, "cos": cos, "sin": sin, "sqrt": sqrt, "sign": lambda x: copysign(1.0, x)}
ROBOTS = {"puma560": 11, "irb120": 11, "ur5e": 10, "cobra600": 5, "planar3": 5}  # formulas without a vector


def computable(formula: str, known: dict[str, float]) -> tuple[float, float] | None:
    """Return both sides of a formula; None if it needs other values."""
    names = sorted(known, key=len, reverse=True)
    symbols = "|".join(map(re.escape, names))
    text = re.sub(
        rf"(?<![A-Za-z0-9])(?:{symbols})(?![A-Za-z0-9])", lambda found: f"V[{names.index(found[0])}]", formula
    )
    text = re.sub(r"(cos|sin) (V\[\d+\])", r"\1(\2)", text.replace("^", "**"))
    text = re.sub(r"(?<=[\w\])]) (?=[\w(])", "*", text)
    if set(re.findall(r"[A-Za-z]\w*", text)) - {*FUNCTIONS, "V"}:
        return None
    sides = (eval(side, {"V": [known[name] for name in names], **FUNCTIONS}) for side in text.split("="))
    left, right = sides
    return left, right


@pytest.mark.parametrize("name", ROBOTS)
def test_every_formula_gives_the_value_beside_it(name: str) -> None:
    random, arm = Random(3), arm_for(load_robot(name))
    family = FAMILIES[arm.method]
    q = tuple(random.uniform(0.6 * low, 0.6 * high) for low, high in zip(arm.model.lower, arm.model.upper, strict=True))
    T, computed = arm.forward(q), set[str]()
    for way in arm.ways:
        steps = arm.branch_steps(T, way, arm.middle)
        if arm.branch_joints(T, way, arm.middle) is None:
            continue
        values = {**arm.constants, **steps}
        known = {family.symbols[one].name: value for one, value in values.items() if one in family.symbols}
        for stage in family.stages:
            assert all(one in steps for one in stage.values)
            for formula in stage.formulas:
                both = computable(formula, known)
                if both is not None:
                    turns = abs(both[0] - both[1]) / (2.0 * pi)
                    assert abs(turns - round(turns)) < 1e-9, formula
                    computed.add(formula)
    assert len(computed) >= ROBOTS[name], computed


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("theta1 = atan2(u py - d px, u)", r"\theta_{1} = \operatorname{atan2}(u\,p_{y} - d\,p_{x}, u)"),
        ("psi = -ARM acos(cos psi)", r"\psi = -\mathrm{ARM}\,\arccos(\cos\,\psi)"),
        ("s = sqrt(ax^2 + sqrt(r^2))", r"s = \sqrt{a_{x}^2 + \sqrt{r^2}}"),
        ("T6 = BASE^-1", r"T_{6} = \mathrm{BASE}^{-1}"),
    ],
)
def test_formulas_in_latex(text: str, written: str) -> None:
    assert latex(text) == written


def test_names_of_users_are_no_latex() -> None:
    assert latex_name("theta_1") == r"\mathrm{theta\_1}"
    assert latex_name(r"a$\input{x}") == r"\mathrm{a\$\\input\{x\}}"
    assert latex_name("A1") == "A_{1}"
