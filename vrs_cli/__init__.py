"""vrs: a VAL-II shell for a virtual robot."""

__version__ = "0.1.0"
