"""The way in without an editor: a folder to try things in."""

from pathlib import Path
from typing import Annotated

import typer


def example(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A new folder for the files.")],
) -> int:
    """Write files to try every command on: a nominal, measured points, plans, a surface, a register map."""
    from cmmlink.demo.example import write_example

    for path in write_example(folder):
        typer.echo(str(path))
    typer.echo(f"{folder / 'README.txt'} says what to try")
    return 0
