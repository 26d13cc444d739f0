"""The methods of projection by name."""

from typing import Literal

Method = Literal["exact", "circle", "chord", "pcp", "veaw", "inversion"]
