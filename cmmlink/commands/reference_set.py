"""The command that writes the reference set."""

from pathlib import Path
from typing import Annotated

import typer


def reference(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A new folder for the set.")],
) -> int:
    """Write the reference set: cases of points and nominals whose truth is known, to try any inspection program on.

    The files are the same to the last bit on every computer. README in the folder says what they are, and scoring.csv is a sheet in which
    another program's values are set beside the truth.
    """
    from cmmlink.reference import reference_cases, write_reference

    sums = write_reference(folder, reference_cases())
    cases = {Path(name).parent for name in sums} - {Path(".")}
    typer.echo(f"{len(cases)} cases written to {folder}; README there says what they are")
    return 0
