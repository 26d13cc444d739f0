"""What can go wrong in the application itself.

PlanError     an inspection plan cannot be used
YamlError     a YAML text is not what its reader expects; it knows the line, its caller adds the file
StoreError    the record of a run could not be kept or read
  StationBusyError another process records at this station just now
RunError      no such run is recorded
AnswerError   the machine that asked for a verdict cannot be told it
PlantError    the results database of a plant cannot be used
  PlantAwayError   it cannot be reached just now

A message says what, where (file, line, key), what was found and what is allowed.
"""


class PlanError(ValueError):
    """An inspection plan cannot be used."""


class YamlError(ValueError):
    """A YAML text is not what its reader expects."""


class StoreError(Exception):
    """The record of a run could not be kept or read."""


class StationBusyError(StoreError):
    """Another process records at this station just now."""


class RunError(ValueError):
    """No such run is recorded."""


class AnswerError(Exception):
    """The machine that asked for a verdict cannot be told it."""


class PlantError(Exception):
    """The results database of a plant cannot be used."""


class PlantAwayError(PlantError):
    """The results database of a plant cannot be reached just now."""
