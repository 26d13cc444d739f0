"""What the application itself refuses.

PlanError     a plan, or an input it names, cannot be used
StoreError    the record could not be kept
"""


class PlanError(ValueError):
    """A plan, or an input it names, cannot be used: file, line, key, the value found and what is allowed."""


class StoreError(Exception):
    """The record of a run could not be kept or read."""
