"""The formats that results are handed over in, by the names that plans and options use."""

from typing import Literal

FormatName = Literal["qif", "dfq", "xlsx", "csv", "json"]
