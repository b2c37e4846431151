"""The version of vrs, in a place of its own: everything may import it, and it imports nothing."""

__version__ = "0.1.0"
