"""What can go wrong with a device, as the rest of the application sees it.

DeviceError
  LinkError       the link could not be opened, was lost, or stays silent
  ProtocolError   what arrives is not what the plan's device sends
  DeviceRefused   the device answered, and said no
PointFileError    a file of points cannot be used
MeshError         a surface file, or a cut through it, cannot be used
CadError          a CAD file, or a section of it, cannot be used

Libraries' own exceptions (pyserial, pymodbus) are translated in the one file that imports the library.
A message says what happened, where (port or address), and what the operator can do.
"""


class DeviceError(Exception):
    """A device or its link failed."""


class LinkError(DeviceError):
    """The link could not be opened, was lost, or stays silent."""


class ProtocolError(DeviceError):
    """What arrives is not what the plan's device sends."""


class DeviceRefused(DeviceError):  # noqa: N818 - the name is fixed by DESIGN: it reads as the sentence it is
    """The device answered, and said no."""


class PointFileError(ValueError):
    """A file of points cannot be used; the message names file, line, what was found and what is expected."""


class MeshError(ValueError):
    """A surface file or a cut through it cannot be used; the message names the file, the place in it, and what to do."""


class CadError(ValueError):
    """A CAD file or a section of it cannot be used; the message says why, and what to do."""
