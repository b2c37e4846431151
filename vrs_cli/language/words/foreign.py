"""List words of other languages (Python, BASIC, Kawasaki AS, KRL, RAPID, URScript) and of shells, with what to write
instead in VAL-II; and make hints for variables without a value."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS, PROGRAM_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import WordRow

# operators and signs of other languages, with the hint for each
FOREIGN_SIGNS = {
    "!=": "<> is unequal",
    "&&": "AND is both",
    "||": "OR is either",
    "%": "MOD gives the rest of a division: 7 MOD 3",
    "{": "THEN, DO or OF begins a block, END ends it",
    "}": "END ends a block",
    "&": "+ joins texts, AND is both",
    "|": "OR is either",
    "!": "NOT is the opposite, <> is unequal",
    "~": "NOT is the opposite, <> is unequal",
    # typographic signs that word processors insert
    **dict.fromkeys("“”„«»‘’", 'straight quotes enclose a text: "hello"'),
    **dict.fromkeys("–—−", "the minus sign is -"),
    **dict.fromkeys("×·", "* multiplies"),
    **dict.fromkeys("÷", "/ divides"),
    **dict.fromkeys("≤≥≠", "the relations are == <> < > <= >="),
}
POWER, QUOTES = "** raises to a power: 2 ** 3", 'a text stands in double quotes: "hello"'
QUOTIENT, WHOLE = r"//\s*[\d(]", "INT(7 / 2) is a whole quotient; a comment begins with ;"
FOREIGN_COMMENT, OWN_COMMENT = r"//|/\*|#(?![A-Za-z])", "a comment begins with ;"
# matches a sign that begins a comment in another language if it starts a line (% MATLAB, ' BASIC, ! RAPID, -- Lua)
LINE_COMMENT = rf"{FOREIGN_COMMENT}|[%'!*](?=\s)|--(?=\s)"
UNITS, NO_UNIT = (
    frozenset(["MM", "CM", "M", "DEG", "DEGREES", "RAD", "S", "SEC", "MS", "MMS", "MPS", "MM/S", "M/S"]),
    "numbers have no unit: lengths are mm, angles degrees, times seconds",
)
PERCENT = "SPEED 50 is in percent, SPEED 500 MMPS in mm/s"
MEANT_ELSEWHERE = {  # words of VAL-II that mean something else in other languages, with a hint for that meaning
    "SWITCH": "CASE x OF chooses by a value",
    "SIGNAL": "SIGNAL 1 turns a signal on, SIGNAL -1 turns it off",
    "RESET": "RESET turns all off, SIGNAL -1 turns one off",
    "WAIT": "TIMER 1 = 0 and WAIT TIMER(1) > 2 let two seconds pass",
    "RANDOM": "1 + INT(6 * RANDOM) is a whole number from 1 to 6",
}
_ONLY_READ = {  # functions to which students try to assign a value, with a hint on what to write instead
    "SIG": f"SIG(1) is the state of a signal; {MEANT_ELSEWHERE['SIGNAL']}",
    **dict.fromkeys(("DX", "DY", "DZ"), "SET p = SHIFT(p BY dx, dy, dz) moves a place"),
}
LABELS = "a label is a number before a statement: 10 TYPE"
# words with which users try to write a relative motion, as in MOVE Z 100
SIDES = frozenset(["X", "Y", "Z", "UP", "DOWN", "LEFT", "RIGHT", "FORWARD", "BACK"])

# words with which users try to write a time, as in DRIVE 1, 30 AFTER 2
TIMED = frozenset(["AFTER", "DURING", "FOR", "TIME", "UNTIL", "WHEN"])

# names of functions in other languages, with the hint for each
FOREIGN_FUNCTIONS: Mapping[str, str] = {
    **dict.fromkeys(
        ("STR", "STRING", "NUM2STR", "TOSTRING", "FORMAT", "STR$", "$STR"), "$ENCODE(5) is the text of a number"
    ),
    **dict.fromkeys(("FLOAT", "STR2NUM", "STR2DOUBLE", "TONUMBER", "NUM"), 'VAL("5") is the number of a text'),
    **dict.fromkeys(("ROUND", "FLOOR", "CEIL"), "INT(x) cuts the decimals off: INT(x + 0.5) rounds"),
    "POW": POWER,
    "MOD": "MOD stands between its numbers: 7 MOD 3",
    **dict.fromkeys(("RAND", "RND"), "RANDOM is a number from 0 to 1"),
    **dict.fromkeys(("ATAN", "ASIN", "ACOS", "ARCTAN"), "ATAN2(y, x) is the inverse function here"),
    **dict.fromkeys(("RADIANS", "DEGREES", "DEG", "RAD"), "angles are in degrees; x * 180 / PI converts radians"),
    **dict.fromkeys(("SUBSTR", "LEFT", "RIGHT", "MID", "$LEFT", "$RIGHT"), "$MID($s, 1, 2) is a part of a text"),
    **dict.fromkeys(("CHR", "CHAR"), "$CHR(65) is a character"),
    **dict.fromkeys(("FIND", "INSTR", "INDEX"), "POS($s, $part) finds a part of a text"),
    **dict.fromkeys(("UPPER", "LOWER", "SPLIT"), "$MID, $DECODE and POS take texts apart"),
    **dict.fromkeys(("POSE", "LOC", "LOCATION", "POINT", "XYZ"), "TRANS(x, y, z, o, a, t) is a place"),
    **dict.fromkeys(("JOINTS", "PPOINT", "JOINT", "J"), "#PPOINT(j1, j2, j3, j4, j5, j6) is a place by its joints"),
    **dict.fromkeys(("DIN", "GETDI", "DI", "SIGNAL", "GET_DIGITAL_IN"), "SIG(1001) reads a signal"),
    **dict.fromkeys(
        ("INPUT", "READLINE", "GETS"), 'PROMPT "How many? ", x asks for a number; SIG(1001) reads a signal'
    ),
    "READ": "READ (lun) x, $s reads a line of a file, PROMPT $s, x one of the terminal",
    **dict.fromkeys(("EOF", "FEOF"), "IOSTAT(lun) is below 0 when a READ finds no more lines"),
    **dict.fromkeys(("RANDINT", "UNIFORM"), MEANT_ELSEWHERE["RANDOM"]),
    **dict.fromkeys(("EXP", "LOG", "LN", "LOG10"), "2.718282 ** x is the exponential function; there is no logarithm"),
    **dict.fromkeys(("DIST", "NORM"), "DISTANCE(a, b) is the distance of two places"),
    "RANGE": "FOR i = 0 TO 2 counts 0, 1, 2",
    **dict.fromkeys(("OPEN", "FOPEN"), 'ATTACH (lun, 4) "DISK" and FOPENR (lun) "name" open a file to be read'),
}

# maps each VAL-II word to the words of other languages with the same meaning
_SAME = {
    "TYPE": "PRINT PRINTF PRINTLN ECHO DISP DISPLAY TPWRITE TEXTMSG CONSOLE.LOG",
    "PROMPT": "INPUT RAW_INPUT",
    "DELAY": "SLEEP TWAIT DWELL WAITTIME",
    "READY": "HOME GOHOME",
    "MOVE": "MOVEJ MOVJ MOVEABSJ PTP",
    "MOVES": "MOVEL LMOVE MOVL LIN MOVELIN",
    "APPRO": "JAPPRO APPROACH",
    "APPROS": "LAPPRO",
    "DEPART": "JDEPART RETRACT",
    "DEPARTS": "LDEPART",
    "CLOSEI": "GRIP GRAB CLOSEHAND",
    "OPENI": "UNGRIP OPENHAND",
    "SIGNAL": "PULSE OUTPUT SETDO DOUT SETOUT SET_DIGITAL_OUT",
    "SPEED": "VEL VELOCITY OVERRIDE",
    "TIME": "DATE",
    "EXECUTE": "RUN START PLAY",
    "RETURN": "ENDSUB ENDFUNC",
    "NEXT": "CONTINUE CYCLE ITERATE",
    "END": "ENDFOR ENDWHILE ENDCASE ENDSWITCH WEND ESAC FI DONE",
    "CASE": "SWITCHCASE",
    "ELSE": "ELIF",
    "ANY": "OTHERWISE",
    "WHERE": "POS POSE GETPOS WHEREAMI CURPOS",
    "HELP": "MAN USAGE",
    "EXIT": "BYE LOGOUT",
    "FDIRECTORY": "LS",
    "FLIST": "CAT MORE LESS",
    "FDELETE": "RM UNLINK",
    "FCOPY": "CP",
    "FRENAME": "MV",
}
_MORE: Mapping[str, str] = {  # maps a word of another language to further text for its hint
    **dict.fromkeys(
        ("MOVEJ", "MOVJ", "MOVEABSJ", "PTP", "MOVEL", "MOVL", "LIN", "MOVELIN"),
        "a place is TRANS(x, y, z) in mm, or joints in degrees #PPOINT(j1, j2, ...); SPEED 50 before it sets the speed",
    ),
    "RUN": "LOAD hello reads hello.v2 first",
}
_WORDS: Mapping[str, str] = {foreign: ours for ours, theirs in _SAME.items() for foreign in theirs.split()}

# hints for words of other languages that no single word of VAL-II can replace
_ADVICE: Mapping[str, str] = {
    **dict.fromkeys(("CLEAR", "CLS"), "Ctrl-L clears the screen; ZERO deletes all programs and variables"),
    "NEW": "EDIT name begins a program; ZERO deletes all programs and variables",
    **dict.fromkeys(("RESTART", "RERUN", "AGAIN"), "EXECUTE runs the last program again, PROCEED goes on after a stop"),
    **dict.fromkeys(("ROBOT", "ROBOTS"), "STATUS names the robot; vrs shell --robot NAME chooses another"),
    **dict.fromkeys(
        ("VIEW", "PICTURE", "BROWSER", "PLOT"),
        "SHOW pictures the arm here; HELP VIEW tells of a picture in a browser",
    ),
    **dict.fromkeys(("TUTORIAL", "LEARN", "LESSON", "DEMO"), "HELP TUTORIAL lists lines to try first"),
    "VRS": "vrs begins a command of your system's shell: EXIT leaves this prompt; HELP VIEW tells of pictures here",
    **dict.fromkeys(
        ("PYTHON", "PYTHON3", "PIP", "GIT", "SUDO"), "that is for your system's shell: EXIT leaves this prompt"
    ),
    **dict.fromkeys(
        ("DEF", "FUNCTION", "PROC", "SUB", "FUNC", "PROGRAM", "PROCEDURE", "VOID", "MODULE"),
        ".PROGRAM name begins a program, .END ends it",
    ),
    **dict.fromkeys(("IMPORT", "INCLUDE", "USE"), "LOAD file reads programs from a file"),
    **dict.fromkeys(("AT", "IN", "AFTER"), "a time stands at the end of a line: DRIVE 1, 30 AT 2"),
    **dict.fromkeys(("GRIPPER", "HAND", "TOOL_CLOSE"), "CLOSEI closes the hand, OPENI opens it"),
    **dict.fromkeys(("TRY", "EXCEPT", "CATCH", "RAISE", "THROW"), "REACTE name calls a program when an error comes"),
    **dict.fromkeys(("FOREACH", "FORALL"), "FOR i = 1 TO 3 ... END counts; a[i] is an element of an array"),
    "REPEAT": "FOR i = 1 TO 3 ... END does it three times, DO ... UNTIL x == 3 until then",
    "LOOP": "END ends WHILE x < 3 DO, UNTIL x == 3 ends DO",
    "DEFAULT": "ANY begins what is done for all other values of a CASE",
    **dict.fromkeys(
        ("LET", "VAR", "INT", "FLOAT", "NUM", "DECL", "CONST", "BOOL", "STRING", "CHAR"),
        "x = 5 makes a variable",
    ),
    **dict.fromkeys(("DIM", "ARRAY"), "arrays are not declared: a[1] = 0 makes an element"),
}
_IN_PROGRAM: Mapping[str, str] = dict.fromkeys(("RESTART", "RERUN", "AGAIN"), "GOTO 10 goes back to a label: 10 TYPE")


def theirs() -> Iterable[str]:
    """Return the words of other languages for which VAL-II has a word with the same meaning."""
    return _WORDS


def own_word(foreign: str) -> str:
    """Return the word of VAL-II with the same meaning as a word of another language, or ""."""
    word = foreign.upper()
    return _WORDS.get(word, "") or _WORDS.get(word.rpartition(".")[2], "")  # time.sleep is found as SLEEP


def own_function(foreign: str) -> str:
    """Return a hint on what to write in VAL-II for a function of another language, or "". The module of the function
    (before the last dot) is ignored."""
    return FOREIGN_FUNCTIONS.get(foreign.upper().rpartition(".")[2], "")


def only_reads(function: WordRow) -> tuple[str, str]:
    """Return the detail and the hint for the error of assigning to a function, as in SIG(1) = TRUE or DX(p) = 5."""
    hint = _ONLY_READ.get(function.name, f"it stands where a value does: x = {function.form}")
    return f"{function.name} only reads a value", hint


def form_of(row: WordRow) -> str:
    """Return a hint with the form of a word or function. If other languages use the word differently, the hint also
    says how to write that in VAL-II."""
    meant = MEANT_ELSEWHERE.get(row.name)
    return f"the form is {row.form}" + (f"; {meant}" if meant else "")


def way(foreign: str, *, at_prompt: bool) -> str:
    """Return a hint on what to write in VAL-II for a word of another language, or ""."""
    ours = own_word(foreign)
    row = (COMMANDS.get(ours) if at_prompt else None) or PROGRAM_WORDS.get(ours)
    if row is not None:
        more = f"; {_MORE[foreign.upper()]}" if foreign.upper() in _MORE else ""
        return f"did you mean {ours}? The form is {row.form}{more}"
    return (_IN_PROGRAM.get(foreign.upper(), "") if not at_prompt else "") or _ADVICE.get(foreign.upper(), "")


# --- variables without a value ---

_NO_NAMES: Mapping[str, str] = {  # words of other languages that VAL-II takes as names of variables, with hints
    **dict.fromkeys(
        ("NONE", "NIL", "UNDEFINED"), "0 is nothing here, and FALSE; DEFINED(x) tells whether x has a value"
    ),
    **dict.fromkeys(("GRIPPER", "GRIP", "HAND"), "OPENI and CLOSEI work the hand"),
}


def first_hint(*rows: tuple[object, str]) -> str:
    """Return the first hint whose condition is true, or "". `rows`: pairs of a condition and a hint."""
    return next((hint for applies, hint in rows if applies), "")


def meant_by(name: str) -> str:
    """Return a hint at what the user probably meant by a name such as J1 or part.z; "" for other names."""
    part = re.fullmatch(r"(?i)(\w[\w.]*)\.([xyz])", name)
    base, axis = ("", "") if part is None else (part[1], part[2].upper())
    return first_hint(
        (re.fullmatch(r"(?i)j(oint)?\d", name), "a joint is a number: DRIVE 1, 30"),
        (part, f"D{axis}({base}) is the {axis} of a place, SHIFT({base} BY dx, dy, dz) is one beside it"),
        (
            re.fullmatch(r"(?i)(out|in|do|di)_?\d+", name),
            "a signal is a number: SIGNAL 1 turns one on, SIG(1001) reads one",
        ),
        (re.fullmatch(r"(?i)[efgi]\d+\.\d", name), f"/{name} is a format"),
    )


def assignment_hint(name: str, kind: Kind | None) -> str:
    """Return a hint for a variable without a value: how to assign one, or what the user probably meant; "" if there is
    no better hint than `value_given`. `name`: with an index for an array element."""
    base, bracket, _ = name.partition("[")
    meant = _NO_NAMES.get(base.upper()) or (own_function(base) if bracket else "")
    # the user may have written a function without its arguments: TIMER for TIMER(1)
    function = FUNCTIONS.get(base.upper())
    form = function.form if function is not None and function.arguments else ""
    word = name.upper()
    begins = f"{value_given(name)}; the word {word} begins a line of its own"
    return first_hint(
        (kind is Kind.PRECISION, f"HERE {name} defines it"),
        (meant, meant),
        (form, f"the function is {form}"),
        (kind is Kind.LOCATION, f"HERE {name} or SET {name} = TRANS(x, y, z) defines it"),
        (bracket and kind is Kind.STRING, f"{name} = ... defines it; $MID({base}, 1, 2) is a part of a text"),
        (bracket and kind is Kind.REAL, f"{name} = ... defines it; DX(p) is the X of a place p"),
        (kind is Kind.REAL and (word in INSTRUCTIONS or word in COMMANDS), begins),
        (kind is Kind.REAL, meant_by(name)),
    )


def value_given(name: str) -> str:
    """Return the hint that shows how to assign a value to a variable: `name = ... gives it a value`."""
    return f"{name} = ... gives it a value"


def text_meant(name: str) -> str:
    """Return the hint for TYPE with a variable that has no value: the user may have forgotten quotes around a
    string."""
    return f'{value_given(name)}; a text stands in double quotes: "{name}"'
