"""What can be wrong with a nominal or with measured points.

InspectionError
  NominalError        the nominal profile cannot be used
  RegistrationError   the points cannot be brought onto the nominal
"""


class InspectionError(ValueError):
    """The inspection cannot be carried out on these inputs."""


class NominalError(InspectionError):
    """The nominal profile cannot be used."""


class RegistrationError(InspectionError):
    """The points cannot be brought onto the nominal."""
