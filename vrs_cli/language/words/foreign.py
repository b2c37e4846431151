"""Words of other languages (Python, BASIC, Kawasaki AS, KRL, RAPID, URScript) and of shells, and what says it here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from vrs_cli.language.words.instructions import PROGRAM_WORDS
from vrs_cli.language.words.monitor import COMMANDS

# signs of C and its children, and what says it here
FOREIGN_SIGNS = {
    "!=": "<> is unequal",
    "&&": "AND is both",
    "||": "OR is either",
    "%": "MOD gives the rest of a division: 7 MOD 3",
}
POWER, QUOTES = "** raises to a power: 2 ** 3", 'a text stands in double quotes: "hello"'
FOREIGN_COMMENT, OWN_COMMENT = r"//|#(?![A-Za-z])", "a comment begins with ;"

# the word that does it here, and the words that do it elsewhere
_SAME = {
    "TYPE": "PRINT PRINTF PRINTLN ECHO DISP DISPLAY TPWRITE TEXTMSG",
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
    "SIGNAL": "PULSE SETDO DOUT SETOUT SET_DIGITAL_OUT",
    "SPEED": "VEL VELOCITY OVERRIDE",
    "TIME": "DATE",
    "EXECUTE": "RUN START PLAY",
    "RETURN": "ENDSUB ENDFUNC",
    "END": "ENDFOR ENDWHILE ENDCASE ENDSWITCH WEND ESAC FI DONE",
    "CASE": "SWITCHCASE",
    "ELSE": "ELIF",
    "DO": "LOOP REPEAT",
    "WHERE": "POS POSE GETPOS WHEREAMI CURPOS",
    "HELP": "MAN USAGE",
    "EXIT": "BYE LOGOUT",
    "FDIRECTORY": "LS",
    "FLIST": "CAT MORE LESS",
    "FDELETE": "RM UNLINK",
    "FCOPY": "CP",
    "FRENAME": "MV",
}
_WORDS: Mapping[str, str] = {foreign: ours for ours, theirs in _SAME.items() for foreign in theirs.split()}

# what no word does here
_ADVICE: Mapping[str, str] = {
    **dict.fromkeys(("CLEAR", "CLS"), "Ctrl-L clears the screen; ZERO deletes all programs and variables"),
    "NEW": "EDIT name begins a program; ZERO deletes all programs and variables",
    **dict.fromkeys(("RESTART", "RERUN", "AGAIN"), "EXECUTE runs the last program again, PROCEED goes on after a stop"),
    **dict.fromkeys(("ROBOT", "ROBOTS"), "STATUS names the robot; vrs shell --robot NAME chooses another"),
    **dict.fromkeys(
        ("VIEW", "PICTURE", "BROWSER", "PLOT"),
        "SHOW pictures the arm here; HELP VIEW tells of a picture in a browser",
    ),
    **dict.fromkeys(("TUTORIAL", "LEARN", "LESSON", "DEMO"), "HELP TUTORIAL has lines to begin with"),
    "VRS": "vrs begins a command of your system's shell: EXIT leaves this prompt; HELP VIEW tells of pictures here",
    **dict.fromkeys(("DEF", "FUNCTION", "PROC", "SUB", "FUNC"), ".PROGRAM name begins a program, .END ends it"),
    **dict.fromkeys(("IMPORT", "INCLUDE", "USE"), "LOAD file reads programs from a file"),
    **dict.fromkeys(("LET", "VAR", "DIM", "INT", "FLOAT", "NUM", "DECL"), "x = 5 makes a variable"),
}


def theirs() -> Iterable[str]:
    """The words of other languages that have one here."""
    return _WORDS


def own_word(foreign: str) -> str:
    """The word that does here what a word of another language does; "" where none does."""
    return _WORDS.get(foreign.upper(), "")


def way(foreign: str, *, at_prompt: bool) -> str:
    """How to say here what a word of another language says, as a hint; "" where it is none."""
    ours = own_word(foreign)
    row = (COMMANDS.get(ours) if at_prompt else None) or PROGRAM_WORDS.get(ours)
    if row is not None:
        return f"did you mean {ours}? The form is {row.form}"
    return _ADVICE.get(foreign.upper(), "")
