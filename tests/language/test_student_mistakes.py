"""What students write who know another language: each line is told about, and what would be right."""

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import LocationOutOfRange, VrsError
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.render.text import plain_text

PUMA = load_robot("puma560")


@pytest.mark.parametrize(
    ("line", "told", "hint"),
    [
        ("x += 1", "+= is no sign of VAL-II", "write x = x + ..."),
        ("a[2]++", "++ is no sign of VAL-II", "write a[2] = a[2] + 1"),
        ("MOVE [100, 200, 300]", "[100, 200, 300] is no value", "write MOVE TRANS(100, 200, 300)"),
        (
            "MOVE 100,200,300",
            "MOVE: too many arguments",
            "a place is TRANS(100, 200, 300) or a name, joints are #PPOINT(...)",
        ),
        ("MOVE (100,200,300)", "MOVE takes no parentheses", "a place is TRANS(x, y, z) or a name"),
        (
            "DRIVE(1, 30, 50)",
            "DRIVE takes no parentheses",
            "the form is DRIVE joint, change[, speed] [AT t | IN dt]",
        ),
        ("x = (1, 2)", "a comma has no place in these parentheses", ""),
        ("SET p = TRANS(0, 550", "( is not closed", "every ( needs its )"),
        ("% comment", "% begins no comment", "a comment begins with ;"),
        ("' comment", "' begins no comment", "a comment begins with ;"),
        ("-- comment", "-- begins no comment", "a comment begins with ;"),
        ("/* comment */", "/* begins no comment", "a comment begins with ;"),
        ("DRIVE 2nd, 5", "2nd", "a name begins with a letter"),
        (
            "DRIVE 1, 30deg, 50",
            "30deg",
            "numbers have no unit: lengths are mm, angles degrees, times seconds",
        ),
        ("DELAY 2 s", "s", "numbers have no unit: lengths are mm, angles degrees, times seconds"),
        ("SPEED 0.5 M/S", "M", "SPEED 50 is in percent, SPEED 500 MMPS in mm/s"),
        ("my-part = 5", "my", "a name has letters, digits, . and _: my_part = ..."),
        ("my part = 5", "my", "a name has letters, digits, . and _: my_part = ..."),
        ("a = [1, 2]", "[...] is no value", "each element is assigned by itself: a[1] = ..."),
        ('TYPE "a" + 5', "5 is a real", "a string is wanted: $ENCODE(5) is one"),
        ('TYPE 5 * "2"', '"2" is a string', 'a real is wanted: VAL("2") is one'),
        (
            "SET b = HERE + 5",
            "HERE is a transformation",
            "a real is wanted: DX(p) is one; SHIFT(p BY 0, 0, 50) is a place 50 mm higher",
        ),
        ("TYPE $s[0:2]", ": is no range", "$MID($s, 1, 2) is a part of a text"),
        ("TYPE STR(5)", "there is no function STR", "$ENCODE(5) is the text of a number"),
        ('TYPE f"x={x}"', '"x={x}"', 'commas separate texts and values: TYPE "x =", x'),
        ("MOVE Z 100", "100", "DRAW dx, dy, dz moves by millimetres: DRAW 0, 0, 100"),
        ("IF x == 1:", "a : ends no line", "the form is IF condition THEN | GOTO label"),
        ("WHILE x < 3 {", "{ is no sign of VAL-II", "THEN, DO or OF begins a block, END ends it"),
        (
            "ELSE IF x == 2 THEN",
            "IF after ELSE",
            "IF ... THEN stands on the next line and has an END of its own",
        ),
        ('TYPE "x is %d", 5', "%d is typed as it stands", 'TYPE "x =", x types a value'),
        ('TYPE "{x}"', "{x} is typed as it stands", 'TYPE "x =", x types a value'),
        (
            'TYPE "a\\n"',
            "\\n is typed as it stands",
            "every TYPE ends its line, TYPE alone types an empty one",
        ),
        ("DRIVE 1, PI / 2, 50", "DRIVE takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("MOVE #PPOINT(1.5708, 0)", "#PPOINT takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("SET p = TRANS(500, 0, 0, PI)", "TRANS takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("TYPE COS(3.14159), SIN(-1.5708)", "SIN takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("TYPE COS(3.14159 / 4)", "COS takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("SET p = TRANS(0.3, 0.45, -0.2)", "TRANS takes millimetres", "0.3 m is 300"),
        ("SET home = #PPOINT(0, -90)", "home cannot hold a precision point", "SET #home = ... holds one"),
        ("SET #home = HERE", "#home cannot hold a transformation", "SET home = ... holds one"),
        (
            "SET TRANS(0, 550) = p",
            "a variable is wanted here",
            "SET p = TRANS(x, y, z) gives a place the name p",
        ),
        ("DRIVE J1, 10, 50", "J1 is given a value nowhere", "a joint is a number: DRIVE 1, 30"),
        (
            "TYPE a.x",
            "a.x is given a value nowhere",
            "DX(a) is the X of a place, SHIFT(a BY dx, dy, dz) is one beside it",
        ),
        (
            "SIGNAL 1 = TRUE",
            "SIGNAL takes no = here",
            "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off",
        ),
        ("IF 1001 == TRUE GOTO 10", "1001 is a number here", "SIG(1001) reads the signal"),
        ("IF 1001 GOTO 10", "1001 is a number here", "SIG(1001) reads the signal"),
        (
            "MOVE HERE, 50",
            "MOVE: too many arguments",
            "the form is MOVE location [AT t | IN dt]; SPEED 50 before it sets the speed",
        ),
        ("WHILE TRUE DO\nBREAK\nEND", "BREAK waits for a motion, and there is none", "EXIT leaves a loop"),
        ("FOR i = 3 TO 1\nEND", "no step of this loop is ever carried out", "STEP -1 counts down"),
        ("FOR i = 1 TO 3 STEP -1\nEND", "no step of this loop is ever carried out", "STEP 1 counts up"),
        ("FOR i = 3 DOWNTO 1", "DOWNTO", "a negative STEP counts down: FOR i = 3 TO 1 STEP -1"),
        ("CASE x OF\nDEFAULT:", "DEFAULT", "ANY begins what is done for all other values of a CASE"),
        ("CASE 1:", "a : ends no line", "VALUE 1: begins a case"),
        ("CALL u 5", "5", "arguments stand in parentheses: u(5)"),
        (
            "x = p(3)",
            "there is no function p",
            "CALL p(...) runs the program, which gives values back by its parameters",
        ),
        ("CALL hello", "hello is not in memory", "LOAD hello reads it from hello.v2"),
        (
            "DRIVE 1, 10, 50 AT",
            "a value is missing after AT",
            "a time is in seconds: AT 2 is a time of the clock, IN 2 is two seconds from now",
        ),
        (
            "DRIVE 1, 10, 50 AFTER 2",
            "AFTER",
            "a time is in seconds: AT 2 is a time of the clock, IN 2 is two seconds from now",
        ),
        ("AT 2 DRIVE 1, 10", "AT", "a time stands at the end of a line: DRIVE 1, 30 AT 2"),
        ("DRIVE 1, 10 AT 12:30", ": joins places, no numbers", "a time is in seconds: 90"),
        ("BASE HERE", "HERE is a transformation", "the form is BASE [dx][, dy][, dz][, rotation]"),
        (
            "SET b = INVERSE(#a)",
            "#a is a precision point",
            "a transformation is wanted: HERE p keeps the place where the arm stands as one",
        ),
        ('$s = "a" & "b"', "& is no sign of VAL-II", "+ joins texts, AND is both"),
        ("x, y = 1, 2", "x", "a line assigns one variable: x = ..."),
        ("SPEED 50%", "% is no sign of VAL-II", "SPEED 50 is in percent, SPEED 500 MMPS in mm/s"),
        (
            "DRIVE 1, 30°",
            "° is no sign of VAL-II",
            "numbers have no unit: lengths are mm, angles degrees, times seconds",
        ),
        ("RETURN x * 2", "it leaves out steps after the CALL", "a program gives values back by its parameters"),
        ("$p = HERE", "$p holds a text", "SET p = ... is a place"),
        ("UNTIL x == 3", "UNTIL without DO", "DO, alone on its line, begins the loop"),
        ("END", "END without IF, WHILE, FOR or CASE", ".END ends the program"),
        (
            "NEXT i",
            "NEXT takes a whole number of loops",
            "NEXT alone is for the innermost, NEXT 2 for two; END ends the steps of a loop",
        ),
        ("EXIT", "EXIT 1 with no loop around it", "the loops are FOR, WHILE and DO; RETURN ends a program"),
        ("MOVE TO part", "TO has no place here", "the form is MOVE location [AT t | IN dt]"),
        (
            "x = 1\nMOVE x",
            "x is a real since step 1",
            "a transformation or a precision point is wanted: TRANS(x, y, z) is one",
        ),
        (
            "MOVE 0, -90, 90, 0, 0, 0",
            "MOVE: too many arguments",
            "a place is TRANS(0, -90, 90, 0, 0, 0) or a name, joints are #PPOINT(0, -90, 90, 0, 0, 0)",
        ),
        ("SET part = HERE\nMOVE #part", "#part is given a value nowhere", "did you mean part?"),
        ("GRIPPER CLOSE", "GRIPPER", "CLOSEI closes the hand, OPENI opens it"),
        ("CLOSE GRIPPER", "GRIPPER is given a value nowhere", "OPENI and CLOSEI work the hand"),
        ("TYPE TIMER", "TIMER is given a value nowhere", "the function is TIMER(timer)"),
        ("SET part := HERE", ":= is no sign of VAL-II", "= assigns, == compares"),
        ("TYPE hello world", "world", 'a text stands in double quotes: "hello world"'),
        (
            'x = input("how many")',
            "there is no function input",
            'PROMPT "How many? ", x asks for a number; SIG(1001) reads a signal',
        ),
        (
            'TYPE "one\\ntwo"',
            "\\n is typed as it stands",
            "every TYPE ends its line, TYPE alone types an empty one",
        ),
        ('x = "a" + "b"', "x holds a number, no string", "$x = ... holds a string"),
        ("TYPE \u201chello\u201d", "\u201c is no sign of VAL-II", 'straight quotes enclose a text: "hello"'),
        ("DO WHILE x < 3", "WHILE after DO", "the form is WHILE condition DO"),
        ("LOOP", "LOOP", "END ends WHILE x < 3 DO, UNTIL x == 3 ends DO"),
        (
            '1: TYPE "one"',
            "a line begins with a word or the variable that is assigned",
            "a label has no colon: 10 TYPE; VALUE 1: begins what a CASE does for 1",
        ),
        ("PROGRAM wave", "PROGRAM", ".PROGRAM name begins a program, .END ends it"),
        ("GOSUB 100", "a program name is wanted here", "GOTO 100 goes to a label"),
        ("x = 1 : y = 2", "= has no place here", "a line holds one statement, : joins places"),
        ("TYPE 1 < x < 5", "it is taken as (1 < x) < 5", "1 < x AND x < 5"),
        (
            "x = RANDOM(1, 6)",
            "RANDOM: too many arguments",
            "the form is RANDOM; 1 + INT(6 * RANDOM) is a whole number from 1 to 6",
        ),
        (
            "MOVE part 50",
            "50",
            "an operator or a comma is missing before 50; the form is MOVE location [AT t | IN dt]",
        ),
        ("WAIT SIG(1001) = ON", "WAIT takes no = here", "= assigns, == compares; the form is WAIT [condition]"),
        ("OUTPUT 1 ON", "OUTPUT", "did you mean SIGNAL? The form is SIGNAL signal, ... [AT t | IN dt]"),
        ("MOVEPART", "MOVEPART", "a blank is missing: MOVE PART"),
        (
            'MOVE "part"',
            '"part" is a string',
            "a transformation or a precision point is wanted: a name stands without quotes",
        ),
        ("MOVE TRANS 0, 500", "0", "the form is TRANS([x][, y][, z][, o][, a][, t])"),
        ("IF SIG 1001 THEN", "1001", "the form is SIG(signal[, signals, ...])"),
        ("MOVE #(0, -90, 90)", "#", "#PPOINT(j1, j2, j3, j4, j5, j6) is a place by its joints"),
        (
            "SET p = (0, 550, -250)",
            "a comma has no place in these parentheses",
            "a place is TRANS(x, y, z) or a name",
        ),
        ("SET n = 5", "5 is a real", "n = ... gives a number"),
        ("TYPE /F6,2, x", "2 is a value here", "/F6.2 has a point"),
        ("TYPE F6.2, x", "F6.2 is given a value nowhere", "/F6.2 is a format"),
        ("$s = bob", "bob is not a string", '$bob is one, "bob" is a text'),
        ('name$ = "bob"', "name", "$name is a text"),
        ("FOR i IN 1..3", "1..3", "FOR i = 1 TO 3 counts from 1 to 3"),
        ("FOREACH p IN a", "FOREACH", "FOR i = 1 TO 3 ... END counts; a[i] is an element of an array"),
        ("try:", "try", "REACTE name calls a program when an error comes"),
        ("y = CALL b(1)", "b", "CALL b(...) stands alone, and gives values back by its parameters"),
        ("a[0] = HERE", "a location is assigned by SET", "SET a[0] = ..."),
        ("a[1][2] = 5", "[", "the indexes stand in one pair: a[1, 2]"),
        (
            "SIGNAL OUT1",
            "OUT1 is given a value nowhere",
            "a signal is a number: SIGNAL 1 turns one on, SIG(1001) reads one",
        ),
        ("TIMER = 0\nTYPE timer", "timer is a variable here", "the form of the instruction is TIMER timer = seconds"),
        ("ATTACH 5", "5 is a real", "the form is ATTACH [(unit[, mode])] [$device]"),
        (".ENDE", ".ENDE", "did you mean .END?"),
        ("DELAY 500", "DELAY takes seconds", "500 ms is 0.5"),
        (
            'ATTACH (lun, 4) "DISK"\nFOPENR (lun) "a.txt"\nREAD (lun) x',
            "without the file the program goes on, and nothing tells",
            "IF IOSTAT(lun) < 0 THEN behind it asks",
        ),
        ("DELAY 0,5", "DELAY: too many arguments", "a decimal number has a point: 0.5"),
        ("TYPE 7%3", "% is no sign of VAL-II", "MOD gives the rest of a division: 7 MOD 3"),
        ("TYPE 2^3", "2^3", "** raises to a power: 2 ** 3"),
        ("TYPE 'hello'", "'hello'", 'a text stands in double quotes: "hello"'),
        ('name = "bob"', "name holds a number, no string", "$name = ... holds a string"),
        ("TYPE SIN(PI/2)", "SIN takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("TYPE COS(2*PI*0.25 + 1)", "COS takes degrees", "half a turn is 180; x * 180 / PI converts radians"),
        ("x = 3; y = 4", "y = 4 is a comment", "a line holds one statement"),
        ("OPENI 1; OPENI 2", "OPENI 2 is a comment", "a line holds one statement"),
        ("RETURN 5", "it leaves out steps after the CALL", "a program gives values back by its parameters"),
        ("MOVE part", "part is given a value nowhere", "HERE part or SET part = TRANS(x, y, z) defines it"),
        ("MOVE #part", "#part is given a value nowhere", "HERE #part defines it"),
        (
            "WAIT 0.5",
            "0.5 is always true, and nothing is waited for",
            "TIMER 1 = 0 and WAIT TIMER(1) > 2 let two seconds pass",
        ),
        ("x = 3,14", ",", "a decimal number has a point: 3.14"),
        ("TYPE round(3.7)", "there is no function round", "INT(x) cuts the decimals off: INT(x + 0.5) rounds"),
        ("TYPE math.floor(2)", "there is no function math.floor", "INT(x) cuts the decimals off: INT(x + 0.5) rounds"),
        ("TYPE 7 // 2", "// begins no comment", "INT(7 / 2) is a whole quotient; a comment begins with ;"),
        ("TYPE 7 // two", "// begins no comment", "a comment begins with ;"),
        ("int i = 3", "int", "x = 5 makes a variable"),
        ("start:", "start", "a label is a number before a statement: 10 TYPE"),
        ("WHILE x < 3 DO\nCONTINUE\nx = x + 1\nEND", "CONTINUE", "did you mean NEXT? The form is NEXT [loops]"),
        (
            "SWITCH x",
            "SWITCH: = value is missing",
            "the form is SWITCH switch = value; CASE x OF chooses by a value",
        ),
        ("APPRO 50, part", "50 is a real", "the form is APPRO location, distance [AT t | IN dt]"),
        ("TYPE x, /F6.2", "no value follows this format", "a format stands before its value: TYPE /F..., x"),
        (
            "SIGNAL 1, ON",
            "ON is no number of a signal",
            "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off, SIG(1001) reads one",
        ),
        (
            "x = 0\nWHILE x < 3 DO\nTYPE x\nEND",
            "no step of this loop changes x",
            "x = x + 1 in the loop counts",
        ),
        ("x = 0\nDO\nMOVE HERE\nUNTIL x > 3", "no step of this loop changes x", "x = x + 1 in the loop counts"),
        (
            "TYPE Hello",
            "Hello is given a value nowhere",
            'Hello = ... gives it a value; a text stands in double quotes: "Hello"',
        ),
        ("RESTART", "RESTART", "GOTO 10 goes back to a label: 10 TYPE"),
        (
            "SIGNAL 1, 0",
            "0 is no number of a signal",
            "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off, SIG(1001) reads one",
        ),
        (
            "MOVE NULL",
            "the wrist would be 0.0 mm from the axis of joint 1, it cannot come nearer than 149.1 mm",
            "NULL is the robot's origin, X = Y = Z = 0, where no tool can be",
        ),
        (
            "x = undo + 1",
            "undo is given a value nowhere",
            "undo = ... gives it a value; the word UNDO begins a line of its own",
        ),
        ("WAIT n", "n is given a value nowhere", "n = ... gives it a value"),
        ("$s = $t", "$t is given a value nowhere", "$t = ... gives it a value"),
        ("WAIT 3", "it waits for the signal: WAIT SIG(1003)", "TIMER 1 = 0 and WAIT TIMER(1) > 2 let two seconds pass"),
        ("IF SIG(1) == 1 THEN\nEND", "SIG(1) is TRUE (-1) or FALSE (0), never 1", "write SIG(1)"),
        ("WHILE SIG(1001) <> 1 DO\nEND", "SIG(1001) is TRUE (-1) or FALSE (0), never 1", "write NOT SIG(1001)"),
        ("WAIT 1 == SIG(1001, -1002)", "SIG(1001, -1002) is TRUE (-1) or FALSE (0), never 1", "write SIG(1001, -1002)"),
        ("TYPE SIG(1001) > 0", "SIG(1001) is TRUE (-1) or FALSE (0)", "write SIG(1001)"),
        (
            "IF NOT SIG(1) AND DEFINED(x) == 1 GOTO 10",
            "DEFINED(x) is TRUE (-1) or FALSE (0), never 1",
            "write DEFINED(x)",
        ),
        ("busy = NOT SIG(1001)\nIF busy == 1 THEN\nEND", "busy is TRUE (-1) or FALSE (0), never 1", "write busy"),
        (
            "FOR i = 1 TO 3\nMOVE HERE\nIF i == 2 THEN\nTYPE i\nBREAK\nEND\nEND",
            "BREAK waits until the arm stands, and leaves no loop",
            "EXIT leaves a loop",
        ),
        ("count = 0\ncuont = count + 1", "cuont is used nowhere", "did you mean count?"),
        (
            "SET part = HERE\npart.z = 100\nMOVE part",
            "part.z is used nowhere",
            "DZ(part) is the Z of a place, SHIFT(part BY dx, dy, dz) is one beside it",
        ),
        ("part_pos = 0\npartpos = part_pos", "partpos is used nowhere", "did you mean part_pos?"),
        ("SET pick = HERE\nSET pikc = HERE\nMOVE pick", "pikc is used nowhere", "did you mean pick?"),
        (
            "SIG(1) = TRUE",
            "SIG only reads a value",
            "SIG(1) is the state of a signal; SIGNAL 1 turns a signal on, SIGNAL -1 turns it off",
        ),
        ("DX(p) = 5", "DX only reads a value", "SET p = SHIFT(p BY dx, dy, dz) moves a place"),
        ("VAL($s) = 5", "VAL only reads a value", "it stands where a value does: x = VAL($s)"),
        (
            "MOVE [0, -90, 90, 0, 0, 0]",
            "[0, -90, 90, 0, 0, 0] is no value",
            "joints in degrees: MOVE #PPOINT(0, -90, 90, 0, 0, 0); a place in mm: MOVE TRANS(...)",
        ),
        ("POINT part = 0, 500, -200, 90, 90, 0", "POINT: too many values", "POINT part = TRANS(x, y, z, o, a, t)"),
        ("SET part TRANS(0, 500)", "TRANS", "= is missing before TRANS; the form is SET location = value"),
        ('EXECUTE "main"', "a program name is wanted here", "it stands without quotes: main"),
        ("SET p = [0, 500, -200]", "[...] is no value", "a place is TRANS(x, y, z) in mm"),
        ("DIM a[10]", "DIM", "arrays are not declared: a[1] = 0 makes an element"),
        ("SPEED 0.5 ALWAYS", "SPEED takes percent", "half speed is SPEED 50"),
    ],
)
def test_each_is_told_with_what_would_be_right(line: str, told: str, hint: str) -> None:
    found = inspect(f".PROGRAM p\n{line}\n.END\n", PUMA)
    assert (told, hint) in [(one.detail, one.hint) for one in found]


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("HERE = start\nMOVE start", "HERE takes no ="),
        ("HERE = TRANS(0, 500)", "HERE takes no ="),
        ("HERE a\nIF HERE == a THEN\nEND", "places are not compared with =="),
        ("HERE #a\nHERE b\nWAIT b <> #a", "places are not compared with <>"),
        ("IF SIG(1) THEN\nENDIF", "ENDIF: not a word of VAL-II"),
        ("IF SIG(1) THEN\nFOR i = 1 TO 3\nENDFOR\nEND", "ENDFOR"),
        ("FOR i = 1 TO 3\nTYPE i\nNEXT i", "NEXT takes a whole number of loops"),
        ("IF SIG(1) THEN\nFOR i = 1 TO 3\nTYPE i\nNEXT i\nEND", "NEXT takes a whole number of loops"),
        ("int x = 5\nTYPE x", "int"),
        ("x := 5\nTYPE x", ":= is no sign of VAL-II"),
        ("FOR i IN 1..3\nTYPE i\nEND", "1..3"),
        ("SET part TRANS(0, 500)\nMOVE part", "TRANS"),
        ('INPUT "how many", n\nTYPE n', "INPUT"),
    ],
)
def test_one_mistake_is_told_once(lines: str, told: str) -> None:
    assert [one.detail for one in inspect(f".PROGRAM p\n{lines}\n.END\n", PUMA)] == [told]


@pytest.mark.parametrize(
    "line",
    [
        "TYPE SIN(x*180/PI), SIN(90), COS(1 / PI), TAN(-y)\nx = 1\ny = 1",
        "x = 3 ; y is 4 later",
        "x = 3 ; y == 4 holds",
        "OPENI ; open the hand",
        "TYPE SIN(1.57 * 180 / 3.14159), COS(1.05), TAN(0.5)",
        "SET p = TRANS(0.5, 0, 250, 90, 90, 3)\nMOVE p:TRANS(0.1, -0.2, 0.3)",
        'TYPE "50% done, 100%d {} C:\\\\new"',
        "WHILE x < 3 DO\nMOVE HERE\nBREAK\nx = x + 1\nEND",
        "RETURN x",
        "FOR x = 3 TO 1 STEP -1\nTYPE x\nEND",
        "IF x == 1001 THEN\nTYPE TRUE\nEND\nWHILE TRUE DO\nx = 1\nEND",
        "IF (1 == x) == TRUE THEN\nWAIT SIG(1001) == TRUE\nEND",
        "TYPE /F6.2, x, /S",
        "DELAY 90\nMOVE HERE\nindex = 1\nmid = 2\nTYPE (1 < x) == (x < 5), index, mid",
        'ATTACH (lun, 4) "DISK"\nFOPENR (lun) "a.txt"\nTYPE IOSTAT(lun)',
        "x = 0\nWHILE x < 3 DO\nREAD (5) x\nEND\nDO\nCALL p\nUNTIL x > 3",
        "x = 0\nWHILE x < 3 DO\nIF y > 3 GOTO 10\nEND\n10 y = 0\nWHILE x < 3 DO\nWAIT SIG(1001)\nEND",
        "x = 0\nWHILE x < TIMER(1) DO\nTYPE x\nEND\nDO\nEXIT\nUNTIL x == 3",
        "a[1] = 1\na[2] = -1\nTYPE a[1], - -a[2]",
        "IF SIG(1) == TRUE THEN\nTYPE SIG(1) == 0, SIG(1) <> -1, SIG(1) < 0, (1 < x) == (x < 5), BITS(1, 4) == 1\nEND",
        "busy = SIG(1001)\nREAD (5) busy\nIF busy == 1 THEN\nEND\nidle = NOT busy\nidle = 1\nTYPE idle == 1",
        "FOR x = 1 TO 3\nMOVE HERE\nCASE x OF\nVALUE 1:\nBREAK\nANY\nTYPE x\nEND\nEND",
        "FOR x = 1 TO 3\nIF x == 2 THEN\nMOVE HERE\nBREAK\nEND\nEND",
        "FOR x = 1 TO 3\nMOVE HERE\nIF x == 2 THEN\nBREAK\nTYPE x\nEND\nEND\nIF x == 1 THEN\nBREAK\nEND",
        "part1 = 1\npart2 = 1\nposx = x\nposy = x\nidle = 0\nTYPE part1, posx",
        "count = 1\ncounts = 1\nTYPE count, counts\nFOR counst = 1 TO 2\nTYPE x\nEND",
        "SPEED 0.5 IPS\nSPEED 1 MMPS ALWAYS\nSPEED x\nSPEED 30 ALWAYS",
    ],
)
def test_usual_lines_are_not(line: str) -> None:
    assert [str(one) for one in inspect(f".PROGRAM p\nx = 0\ny = 0\n{line}\n.END\n", PUMA)] == []


@pytest.mark.parametrize("heading", ["t(a = 5)", "t(real a)", "t("])
def test_a_parameter_is_a_name_alone(heading: str) -> None:
    found = inspect(f".PROGRAM {heading}\n.END\n", PUMA)
    assert found[0].hint == "a parameter is a name alone: .PROGRAM name(a, $text, #joints)"


def test_an_argument_of_another_kind() -> None:
    found = inspect('.PROGRAM u(a)\nTYPE a\n.END\n.PROGRAM t\nCALL u("hi")\n.END\n', PUMA)
    assert ("a string for the parameter a", "a real or a transformation is wanted; a parameter $a takes this one") in [
        (d.detail, d.hint) for d in found
    ]


@pytest.mark.parametrize(
    ("line", "told", "hint"),
    [
        ("STOP", "STOP is for the program that it stands in", "ABORT stops the robot and its program"),
        ("PAUSE", "PAUSE is for the program that it stands in", "ABORT stops the robot and its program"),
        ("J1 = 30", "j1 is a variable from now on", "a joint is a number: DRIVE 1, 30"),
        (
            "part.z = 5",
            "part.z is a variable from now on",
            "DZ(part) is the Z of a place, SHIFT(part BY dx, dy, dz) is one beside it",
        ),
        ("HERE = 5", "here is a variable from now on", "HERE p keeps the place where the arm stands"),
    ],
)
def test_at_the_prompt(line: str, told: str, hint: str) -> None:
    statement = parse_prompt(line, ())
    assert statement is not None
    assert (told, hint) in [(one.detail, one.hint) for one in check_line(statement)]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("MOVE NULL", "(NULL is the robot's origin, X = Y = Z = 0, where no tool can be)"),
        ("MOVES NULL", "(NULL is the robot's origin, X = Y = Z = 0, where no tool can be)"),
        ("restart", "restart (EXECUTE runs the last program again, PROCEED goes on after a stop)"),
        ("SIGNAL 1, 0", "0 is no number of a signal (SIGNAL 1 turns a signal on, SIGNAL -1 turns it off"),
        ("TYPE Hello", 'Hello (Hello = ... gives it a value; a text stands in double quotes: "Hello")'),
        ("x = y", "y (y = ... gives it a value)"),
        (
            "UNDO UNDO",
            "undo (undo = ... gives it a value; the word UNDO begins a line of its own)",
        ),
    ],
)
def test_a_line_that_fails_at_the_prompt(line: str, told: str) -> None:
    terminal = RecordingTerminal()
    session = Session(terminal)
    try:
        session.perform(line)
        said = "".join(map(plain_text, terminal.replies))
    except VrsError as error:
        said = str(error)
    assert told in said


def test_null_is_another_place_where_base_has_moved_it() -> None:
    session = Session(RecordingTerminal())
    session.perform("BASE 0, -3000")
    with pytest.raises(LocationOutOfRange, match="nearer") as refused:
        session.perform("MOVE NULL")
    assert "NULL" not in str(refused.value)
