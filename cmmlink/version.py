"""The version of cmmlink and that of its results, each in one place."""

from typing import Literal

__version__ = "0.1.0"

ResultSchema = Literal["urn:cmmlink:result:1"]
RESULT_SCHEMA: ResultSchema = "urn:cmmlink:result:1"  # its number rises where a key goes or changes its meaning; keys are added without
