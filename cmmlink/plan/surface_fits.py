"""How a scan comes onto a whole surface, by name: apart from plans, so that who only names a fit loads none."""

from typing import Literal

SurfaceFit = Literal["best-fit", "none"]
