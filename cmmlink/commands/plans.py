"""The way in without an editor: a folder to try things in, and the commands on plans beside `plan new`: their keys, and a schema."""

import json
from pathlib import Path
from typing import Annotated

import typer

from cmmlink.commands.new_plan import new
from cmmlink.errors import PlanError

plan = typer.Typer(help="Make a plan, look up its keys, or write a schema for editors.", rich_markup_mode=None)
plan.command()(new)


@plan.command()
def keys(
    key: Annotated[str | None, typer.Argument(metavar="[KEY]", help="A key, like tolerance.lower_mm, or a group of keys.")] = None,
) -> int:
    """Show what may stand in a plan: all keys, or one with its meaning, its default and an example."""
    from cmmlink.plan import all_keys, keys_named

    for entry in all_keys() if key is None else keys_named(key):
        typer.echo("\n".join(entry.lines))
    return 0


@plan.command()
def schema(
    out: Annotated[Path | None, typer.Option("--out", "-o", metavar="FILE.json", help="Where to write it; else it is printed.")] = None,
) -> int:
    """Write a JSON schema of plans, with which editors complete and check them.

    Most editors take it by a first line in the plan: # yaml-language-server: $schema=FILE.json
    """
    from cmmlink.plan import schema_of_plans

    text = json.dumps(schema_of_plans(), indent=1)
    if out is None:
        typer.echo(text)
        return 0
    try:
        out.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise PlanError(f"{out}: cannot be written: {error.strerror or error}") from None
    typer.echo(f"written to {out}; an editor takes it by a first line in the plan: # yaml-language-server: $schema={out.name}")
    return 0


def example(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A new folder for the files.")],
) -> int:
    """Write files to try every command on: a nominal, measured points, plans, a surface, a register map."""
    from cmmlink.demo.example import write_example

    for path in write_example(folder):
        typer.echo(str(path))
    typer.echo(f"{folder / 'README.txt'} says what to try")
    return 0
