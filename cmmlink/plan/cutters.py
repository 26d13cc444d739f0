"""What may cut a surface, by name. It is a file of its own because the command line shows the names before it loads any plan."""

from typing import Literal

CutterName = Literal["auto", "open3d", "numpy"]
