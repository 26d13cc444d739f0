"""What can be wrong with a nominal or with measured points.

InspectionError
  NominalError        the nominal profile cannot be used
  RegistrationError   the points cannot be brought onto the nominal
  NotMeasured         the set-up contradicts the points: there is no verdict, but something to mend
"""


class InspectionError(ValueError):
    """The inspection cannot be carried out on these inputs."""


class NominalError(InspectionError):
    """The nominal profile cannot be used."""


class RegistrationError(InspectionError):
    """The points cannot be brought onto the nominal."""


class NotMeasured(InspectionError):  # noqa: N818 - the name that users know it by
    """The set-up contradicts the points: nothing was measured, and the message names the likely mend."""
