"""The version of cmmlink, in one place."""

__version__ = "0.1.0"
