"""The operators and the words that link, one row each: what HELP says, and whether VAL-II has them (val2 section 2)."""

from __future__ import annotations

from collections.abc import Mapping

from vrs_cli.language.words.word import WordRow, by_name


class Operator(WordRow, frozen=True, eq=False, dict=True):
    """A row under its `name`, which its form does not begin with; `also`: another spelling."""

    name: str = ""
    also: str = ""


def _row(name: str, form: str, where: str, summary: str, example: str, also: str = "") -> Operator:
    return Operator(form, where, summary, example, name=name, also=also)


_OPERATORS = (
    _row("+", "a + b", "1 2 +", "the sum of two numbers; of two strings, one after the other", 'TYPE 2+3, "A-"+"17"'),
    _row("-", "a - b", "1 2 +", "the difference; before a value, its negative", "x = -y-1"),
    _row("*", "a * b", "1 2 +", "the product", "x = 2*y"),
    _row("/", "a / b", "1 2 +", "the quotient", "x = y/2"),
    _row("MOD", "a MOD b", "2 +", "the remainder of a division; both are rounded to integers", "x = 17 MOD 5"),
    _row("**", "a ** b", "+", "the power of a base and an exponent", "x = 2**10"),
    _row("==", "a == b", "2 +", "TRUE where two numbers, or two strings, are equal", "IF x == 5 THEN"),
    _row("<>", "a <> b", "2 +", "TRUE where they are not equal", "IF x <> 5 THEN"),
    _row("<", "a < b", "2 +", "TRUE where the first is less", "IF x < 5 THEN"),
    _row(">", "a > b", "2 +", "TRUE where the first is greater", "IF x > 5 THEN"),
    _row("<=", "a <= b", "2 +", "TRUE where the first is less or equal", "IF x <= 5 THEN", "=<"),
    _row(">=", "a >= b", "2 +", "TRUE where the first is greater or equal", "IF x >= 5 THEN", "=>"),
    _row("EQ", "IF a EQ b THEN label", "1", "VAL's ==, before a label only", "IF n EQ 5 THEN 10"),
    _row("NE", "IF a NE b THEN label", "1", "VAL's <>, before a label only", "IF n NE 5 THEN 10"),
    _row("LT", "IF a LT b THEN label", "1", "VAL's <, before a label only", "IF n LT 5 THEN 10"),
    _row("GT", "IF a GT b THEN label", "1", "VAL's >, before a label only", "IF n GT 5 THEN 10"),
    _row("LE", "IF a LE b THEN label", "1", "VAL's <=, before a label only", "IF n LE 5 THEN 10"),
    _row("GE", "IF a GE b THEN label", "1", "VAL's >=, before a label only", "IF n GE 5 THEN 10"),
    _row("NOT", "NOT a", "2 +", "TRUE where a is 0; binds looser than the relations", "IF NOT (x == 5) THEN"),
    _row("AND", "a AND b", "2 +", "TRUE where neither is 0; both are evaluated", "IF (x > 2) AND (y < 3) THEN"),
    _row("OR", "a OR b", "2 +", "TRUE where one of them is not 0; both are evaluated", "IF (x > 2) OR (y < 3) THEN"),
    _row("XOR", "a XOR b", "2 +", "TRUE where exactly one of them is not 0", "IF (x > 2) XOR (y < 3) THEN"),
    _row("COM", "COM a", "2 +", "every bit of an integer turned over", "x = COM 5"),
    _row("BAND", "a BAND b", "2 +", "the bits that both integers have", "x = 6 BAND 3"),
    _row("BOR", "a BOR b", "2 +", "the bits that one of two integers has", "x = 6 BOR 3"),
    _row("BXOR", "a BXOR b", "2 +", "the bits that exactly one of two integers has", "x = 6 BXOR 3"),
    _row(":", "a:b", "1 2 +", "the location b as the frame a sees it", "MOVE pallet:corner"),
)  # fmt: skip

_LINKS = (
    _row("AT", "motion AT t", "",
        "the motion begins at the time t of the timeline [s]; it is planned at once", "MOVE part AT 2.5"),
    _row("IN", "motion IN dt", "",
        "the motion begins so many seconds from now; it is planned at once", "MOVE part IN 0.5"),
    _row("ALWAYS", "setting ALWAYS", "1 2 +",
        "the setting holds from now on, not for the next motion alone", "SPEED 30 ALWAYS"),
    _row("MMPS", "SPEED n MMPS", "2 +", "the speed of the tool tip in mm a second", "SPEED 200 MMPS"),
    _row("IPS", "SPEED n IPS", "2 +", "the speed of the tool tip in inches a second", "SPEED 5 IPS"),
    _row("MONITOR", "SPEED n MONITOR", "+", "the monitor speed, from a program", "SPEED 50 MONITOR"),
    _row("THEN", "IF condition THEN", "2 +",
        "ends the line; what is done stands on the next ones, up to ELSE or END", "IF x > 2 THEN"),
    _row("TO", "FOR variable = first TO last", "2 +", "the last value of a loop", "FOR i = 1 TO 10"),
    _row("STEP", "FOR variable = first TO last STEP step", "2 +",
        "what is added for each pass, 1 where it is left out", "FOR i = 10 TO 0 STEP -2"),
    _row("OF", "CASE number OF", "2 +", "ends the line; VALUE parts follow", "CASE count OF"),
    _row("BY", "SHIFT(a BY dx, dy, dz)", "1 2 +", "what a location is moved or scaled by", "SET b = SHIFT(a BY ,,50)"),
)  # fmt: skip

OPERATORS: Mapping[str, Operator] = by_name(_OPERATORS)
LINKS: Mapping[str, Operator] = by_name(_LINKS)
