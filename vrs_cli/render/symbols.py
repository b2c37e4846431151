"""Define the symbols and formulas of EXPLAIN.

The symbols are those of Lee and Ziegler (1984), and of Fu, Gonzalez and Lee, "Robotics" (1987). theta_i, d_i, a_i:
joint angle, offset and length of link i. A_i = T_(i-1)_i: the pose of frame i in frame i - 1. n, s, a, p: the axes and
the position of T6, the pose of the flange in the robot's frame. ARM, ELBOW, WRIST: +1 for RIGHTY, ABOVE, NOFLIP and -1
for LEFTY, BELOW, FLIP.

The closed forms use further symbols (u h v psi m t), which the formulas define. Their derivations are in the modules of
the closed forms. A stage is one step of the solution: it names formulas and the values (`Steps`) that they give. Each
formula is written once, as text; `latex` converts it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple


class Symbol(NamedTuple):
    """A value that a closed form of the inverse kinematics computes: its name, and the unit in which it is shown: mm,
    mm2, deg, SIGN, or ""."""

    name: str
    unit: str = ""


SIGN = "sign"  # used in place of a unit, for values that are +1 or -1


class Stage(NamedTuple):
    """A step (stage) of the inverse kinematics: a title, formulas, and in `values` the names in `Steps` of the values
    that the formulas give."""

    title: str
    formulas: tuple[str, ...]
    values: tuple[str, ...]


class Family(NamedTuple):
    """A family of arms with one closed form: its stages, and its symbols. The keys of `symbols` are the names of values
    in `Steps` and of the constants of the arm."""

    stages: tuple[Stage, ...]
    symbols: Mapping[str, Symbol]


# --- LaTeX -----------------------------------------------------------------------------------------------------------

_LATEX: Mapping[str, str] = {
    **{name: rf"\{name}" for name in ("theta", "psi", "beta", "cos", "sin")},
    "phi": r"\varphi",
    "acos": r"\arccos",
    **{name: rf"\operatorname{{{name}}}" for name in ("atan2", "sign", "Rot")},
    **{name: rf"\mathrm{{{name}}}" for name in ("ARM", "ELBOW", "WRIST", "BASE", "TOOL")},
}
_WORD = re.compile(r"(?P<name>[A-Za-z]+?)(?P<index>\d|(?<=^.)[xyz]|(?<=[^A-Za-z].)[xyz])?(?![A-Za-z0-9])|atan2")
_BETWEEN = re.compile(r"(?<=[A-Za-z0-9})]) (?=[A-Za-z\\(\[])")  # the blank between two factors
_OWN = re.compile(r"(?:R[xyz]\([OAT]\)|[ATMR]\d?|BASE|TOOL|BASE\^-1|TOOL\^-1| )+")


def latex(text: str) -> str:
    at = text.find("sqrt(")
    if at >= 0:
        end = _closing_index(text, at + len("sqrt"))
        return f"{latex(text[:at])}\\sqrt{{{latex(text[at + len('sqrt(') : end])}}}{latex(text[end + 1 :])}"
    return _BETWEEN.sub(r"\,", _WORD.sub(_latex_word, text)).replace("^-1", "^{-1}")


def _latex_word(found: re.Match[str]) -> str:
    if found[0] in _LATEX:
        return _LATEX[found[0]]
    name = _LATEX.get(found["name"], found["name"])
    return f"{name}_{{{found['index']}}}" if found["index"] else name


def latex_name(name: str) -> str:
    """Return a name in LaTeX: symbols of this module in italics, other names upright."""
    if _OWN.fullmatch(name):
        return latex(name)
    return r"\mathrm{" + re.sub(r"[^\w.,:()+ -]", lambda found: f"\\{found[0]}", name).replace("_", r"\_") + "}"


def _closing_index(text: str, opening: int) -> int:
    """Return the index of the parenthesis that closes the one at the given index."""
    depth = 0
    for at in range(opening, len(text)):
        depth += (text[at] == "(") - (text[at] == ")")
        if not depth:
            return at
    raise ValueError(text)


# --- the closed forms ------------------------------------------------------------------------------------------------

_COMMON: Mapping[str, Symbol] = {
    **{f"q{i}": Symbol(f"theta{i}", "deg") for i in range(1, 7)},
    **{name: Symbol(name, "mm") for name in ("u", "h", "v", "m", "t")},
    **{name: Symbol(name, "mm") for name in ("d1", "d4", "d5", "d6", "a1", "a2", "a3", "l1", "l2")},
    "x": Symbol("px", "mm"),
    "y": Symbol("py", "mm"),
    "z": Symbol("pz", "mm"),
    "u2": Symbol("r^2", "mm2"),
    "side": Symbol("d", "mm"),
    "forearm": Symbol("l", "mm"),
    "beta": Symbol("beta", "deg"),
    "psi": Symbol("psi", "deg"),
    "phi": Symbol("phi", "deg"),
    "k": Symbol("cos psi"),
    **{name: Symbol(name.upper(), SIGN) for name in ("arm", "elbow", "wrist")},
}

_SPHERICAL = Family(
    (
        Stage(
            "The centre of the wrist, where axes 4 to 6 meet; nearer to axis 1 than d, r^2 is negative",
            ("p = p6 - d6 a", "v = d1 - pz", "r^2 = px^2 + py^2 - d^2"),
            ("x", "y", "v", "u2"),
        ),
        Stage(
            "Joint 1, by the shoulder",
            ("u = -ARM sqrt(r^2)", "h = u - a1", "theta1 = atan2(u py - d px, u px + d py)"),
            ("arm", "u", "h", "q1"),
        ),
        Stage(
            "Joint 3, by the elbow; the arm reaches where cos psi is from -1 to 1",
            (
                "cos psi = (h^2 + v^2 - a2^2 - l^2) / (2 a2 l)",
                "psi = -ARM ELBOW acos(cos psi)",
                "theta3 = beta + psi",
            ),
            ("elbow", "k", "psi", "q3"),
        ),
        Stage(
            "Joint 2, which brings upper arm and forearm to the centre of the wrist",
            ("m = a2 + l cos psi", "t = l sin psi", "theta2 = atan2(v m - h t, h m + v t)"),
            ("m", "t", "q2"),
        ),
        Stage(
            "Joints 4, 5 and 6, by the axes n, s, a of the flange in frame 3; where sin theta5 is 0, theta4 is free",
            (
                "theta4 = atan2(WRIST ay, WRIST ax)",
                "theta5 = atan2(WRIST sqrt(ax^2 + ay^2), az)",
                "theta6 = atan2(WRIST (ax ny - ay nx), WRIST (ax sy - ay sx))",
            ),
            ("wrist", "X", "Y", "Z", "s5", "q4", "q5", "q6"),
        ),
    ),
    {
        **_COMMON,
        "X": Symbol("WRIST ax"),
        "Y": Symbol("WRIST ay"),
        "Z": Symbol("az"),
        "s5": Symbol("|sin theta5|"),
    },
)

_OFFSET = Family(
    (
        Stage(
            "The origin of frame 5; nearer to axis 1 than d, r^2 is negative",
            ("p = p6 - d6 a - d1 z", "r^2 = px^2 + py^2 - d^2"),
            ("x", "y", "z", "u2"),
        ),
        Stage(
            "Joint 1, by the shoulder",
            ("u = ARM sign(d) sqrt(r^2)", "theta1 = atan2(u py + d px, u px - d py)"),
            ("arm", "u", "q1"),
        ),
        Stage(
            "Joints 5 and 6, by the axes n, s, a of the flange along those of joints 2 to 4, which is Y here",
            (
                "cos theta5 = ay",
                "sin theta5 = WRIST sqrt(ny^2 + sy^2)",
                "theta6 = atan2(-WRIST sy, WRIST ny)",
            ),
            ("wrist", "c5", "s5", "q5", "q6"),
        ),
        Stage(
            "Joint 3; joint 4 is at (h, v) in the plane of the arm, which reaches where cos theta3 is from -1 to 1",
            (
                "phi = theta2 + theta3 + theta4",
                "h = u - d5 sin phi",
                "v = pz + d5 cos phi",
                "cos theta3 = (h^2 + v^2 - a2^2 - a3^2) / (2 a2 a3)",
                "theta3 = -ARM ELBOW sign(d) acos(cos theta3)",
            ),
            ("elbow", "lift", "level", "h", "v", "k", "q3"),
        ),
        Stage(
            "Joints 2 and 4",
            (
                "theta2 = atan2(v, h) - atan2(a3 sin theta3, a2 + a3 cos theta3)",
                "theta4 = phi - theta2 - theta3",
            ),
            ("q2", "phi", "q4"),
        ),
    ),
    {
        **_COMMON,
        "c5": Symbol("cos theta5"),
        "s5": Symbol("sin theta5"),
        "lift": Symbol("sin phi"),
        "level": Symbol("cos phi"),
        "k": Symbol("cos theta3"),
    },
)

_PARALLEL = Family(
    (
        Stage(
            "The end of the second bar in the plane of the arm, the turn phi of the flange, and its rise",
            ("p = p6 - Rot(phi) b",),
            ("x", "y", "turn", "rise"),
        ),
        Stage(
            "The second bar against the first, by the second joint; the arm reaches where cos psi is from -1 to 1",
            ("cos psi = (px^2 + py^2 - l1^2 - l2^2) / (2 l1 l2)", "psi = ARM acos(cos psi)"),
            ("arm", "k", "psi"),
        ),
        Stage(
            "The first bar, by the first joint, which brings both bars to p",
            ("m = l1 + l2 cos psi", "t = l2 sin psi", "theta1 = atan2(py, px) - atan2(t, m)"),
            ("m", "t", "first"),
        ),
    ),
    {
        **_COMMON,
        "turn": Symbol("phi", "deg"),
        "rise": Symbol("pz", "mm"),
        "first": Symbol("theta1", "deg"),
    },
)

FAMILIES: Mapping[str, Family] = {  # the key is the `method` of an arm
    "closed form, spherical wrist": _SPHERICAL,
    "closed form, joints 2 to 4 parallel": _OFFSET,
    "closed form, all axes parallel": _PARALLEL,
}
