"""The operators and the words that link, one row each: what HELP says, and whether VAL-II has them (val2 section 2)."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct


class Operator(Struct, frozen=True):
    """A row: `where` as in the other tables; `also`: another spelling."""

    name: str
    form: str
    summary: str
    example: str
    where: str = "1 2 +"
    also: str = ""


_OPERATORS = (
    Operator("+", "a + b", "the sum of two numbers; of two strings, one after the other", 'TYPE 2+3, "A-"+"17"'),
    Operator("-", "a - b", "the difference; before a value, its negative", "x = -y-1"),
    Operator("*", "a * b", "the product", "x = 2*y"),
    Operator("/", "a / b", "the quotient", "x = y/2"),
    Operator("MOD", "a MOD b", "the remainder of a division; both are rounded to integers", "x = 17 MOD 5", "2 +"),
    Operator("**", "a ** b", "the power of a base and an exponent", "x = 2**10", "+"),
    Operator("==", "a == b", "TRUE where two numbers, or two strings, are equal", "IF x == 5 THEN", "2 +"),
    Operator("<>", "a <> b", "TRUE where they are not equal", "IF x <> 5 THEN", "2 +"),
    Operator("<", "a < b", "TRUE where the first is less", "IF x < 5 THEN", "2 +"),
    Operator(">", "a > b", "TRUE where the first is greater", "IF x > 5 THEN", "2 +"),
    Operator("<=", "a <= b", "TRUE where the first is less or equal", "IF x <= 5 THEN", "2 +", "=<"),
    Operator(">=", "a >= b", "TRUE where the first is greater or equal", "IF x >= 5 THEN", "2 +", "=>"),
    Operator("EQ", "IF a EQ b THEN label", "VAL's ==, before a label only", "IF n EQ 5 THEN 10", "1"),
    Operator("NE", "IF a NE b THEN label", "VAL's <>, before a label only", "IF n NE 5 THEN 10", "1"),
    Operator("LT", "IF a LT b THEN label", "VAL's <, before a label only", "IF n LT 5 THEN 10", "1"),
    Operator("GT", "IF a GT b THEN label", "VAL's >, before a label only", "IF n GT 5 THEN 10", "1"),
    Operator("LE", "IF a LE b THEN label", "VAL's <=, before a label only", "IF n LE 5 THEN 10", "1"),
    Operator("GE", "IF a GE b THEN label", "VAL's >=, before a label only", "IF n GE 5 THEN 10", "1"),
    Operator("NOT", "NOT a", "TRUE where a is 0; binds looser than the relations", "IF NOT (x == 5) THEN", "2 +"),
    Operator("AND", "a AND b", "TRUE where neither is 0; both are evaluated", "IF (x > 2) AND (y < 3) THEN", "2 +"),
    Operator(
        "OR", "a OR b", "TRUE where one of them is not 0; both are evaluated", "IF (x > 2) OR (y < 3) THEN", "2 +"
    ),
    Operator("XOR", "a XOR b", "TRUE where exactly one of them is not 0", "IF (x > 2) XOR (y < 3) THEN", "2 +"),
    Operator("COM", "COM a", "every bit of an integer turned over", "x = COM 5", "2 +"),
    Operator("BAND", "a BAND b", "the bits that both integers have", "x = 6 BAND 3", "2 +"),
    Operator("BOR", "a BOR b", "the bits that one of two integers has", "x = 6 BOR 3", "2 +"),
    Operator("BXOR", "a BXOR b", "the bits that exactly one of two integers has", "x = 6 BXOR 3", "2 +"),
    Operator(":", "a:b", "the location b as the frame a sees it", "MOVE pallet:corner"),
)

_LINKS = (
    Operator(
        "AT",
        "motion AT t",
        "the motion begins at the time t of the timeline [s]; it is planned at once",
        "MOVE part AT 2.5",
        "",
    ),
    Operator(
        "IN",
        "motion IN dt",
        "the motion begins so many seconds from now; it is planned at once",
        "MOVE part IN 0.5",
        "",
    ),
    Operator(
        "ALWAYS", "setting ALWAYS", "the setting holds from now on, not for the next motion alone", "SPEED 30 ALWAYS"
    ),
    Operator("MMPS", "SPEED n MMPS", "the speed of the tool tip in mm a second", "SPEED 200 MMPS", "2 +"),
    Operator("IPS", "SPEED n IPS", "the speed of the tool tip in inches a second", "SPEED 5 IPS", "2 +"),
    Operator("MONITOR", "SPEED n MONITOR", "the monitor speed, from a program", "SPEED 50 MONITOR", "+"),
    Operator(
        "THEN",
        "IF condition THEN",
        "ends the line; what is done stands on the next ones, up to ELSE or END",
        "IF x > 2 THEN",
        "2 +",
    ),
    Operator("TO", "FOR variable = first TO last", "the last value of a loop", "FOR i = 1 TO 10", "2 +"),
    Operator(
        "STEP",
        "FOR variable = first TO last STEP step",
        "what is added for each pass, 1 where it is left out",
        "FOR i = 10 TO 0 STEP -2",
        "2 +",
    ),
    Operator("OF", "CASE number OF", "ends the line; VALUE parts follow", "CASE count OF", "2 +"),
    Operator("BY", "SHIFT(a BY dx, dy, dz)", "what a location is moved or scaled by", "SET b = SHIFT(a BY ,,50)"),
)

OPERATORS: Mapping[str, Operator] = {row.name: row for row in _OPERATORS}
LINKS: Mapping[str, Operator] = {row.name: row for row in _LINKS}
