"""Write the pages of docs that come from the models: `python docs/generate.py`; a test compares them with what stands there."""

import ast
import inspect
import json
from collections.abc import Callable, Mapping, Set
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, TypeAdapter

import cmmlink
import drivers
import inspection
import simulators
from cmmlink import deviations_csv, surface_csv, uncertainty_tables
from cmmlink.archive import COLUMNS as REJUDGED_COLUMNS
from cmmlink.archive_keys import ArchiveRejudged
from cmmlink.comparison_keys import Compared
from cmmlink.exports import tables
from cmmlink.plan.reference import Group, groups_of, table
from cmmlink.plan.scan import Plan
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan
from cmmlink.plant_keys import PlantAddress, PlantAgreement, PlantOutbox
from cmmlink.qualification import QUANTITIES
from cmmlink.qualification_keys import Qualified
from cmmlink.record import evidence, export
from cmmlink.record_keys import KeyHandedOver, RecordsCopied, StationKey, Verified
from cmmlink.report import stack_folder
from cmmlink.result_keys import (
    Exported,
    FilesInspected,
    Inspected,
    Measured,
    Recorded,
    Replayed,
    Reported,
    Runs,
    Shown,
    StackInspected,
    Understood,
    ZonesVerified,
)
from cmmlink.surface_keys import SurfaceInspected, SurfaceMeasured, SurfaceRecorded, SurfaceReplayed, SurfacesCompared
from cmmlink.trend_keys import PlantTrend
from cmmlink.version import RESULT_SCHEMA
from drivers.codecs import decoders
from drivers.codecs.register_map import PATTERNS, POINTS_FIELDS, POP_FIELDS, STATUS_FIELDS, RegisterMap

DOCS = Path(__file__).parent
EXAMPLES = DOCS / "examples"
WRITTEN = "<!-- Written by docs/generate.py from the models. Change the descriptions there, then run it. -->\n"

PLAN = """
# The inspection plan

A plan is a YAML file that says what is measured, against which nominal, with which device, and where the results go. Four keys are
required; every other key has the default shown. Relative paths are relative to the plan's own folder. `cmmlink check plan.yaml` checks a
plan and every file that it names, and a mistake is reported with its file, line and key.

```yaml
part: {name: blade}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: serial, address: /dev/ttyUSB0}
```

Anchors, aliases, tags and repeated keys of YAML are refused, so that a plan means what a reader sees.
"""

CT_PLAN = """
# The plan of a CT inspection

`cmmlink ct plan.yaml` cuts a surface into sections and inspects each of them. A plan in place of options serves many sections, blades
whose nominal changes with the height, and repetition. Relative paths are relative to the plan's own folder.

```yaml
part: {name: blade}
mesh: {file: blade.stl}
nominal: {file: blade.dat, scale: 60}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
sections: {normal: [0, 0, 1], heights_mm: [20, 50, 80]}
```
"""

SURFACE_PLAN = """
# The plan of a whole surface

A plan with a `surface` in place of a `nominal` holds points in space against a whole surface: CAD, a mesh or a cloud of points.
`cmmlink run plan.yaml` carries it out with any device that gives points in space, and `cmmlink surface` does the same for a file of
points, with options in place of a plan. [Whole surfaces](surfaces.md) says what is judged. Relative paths are relative to the plan's own
folder.

```yaml
part: {name: blade}
surface: {file: blade.stp}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: serial, address: /dev/ttyUSB0}
```
"""

REGISTER_MAP = """
# The register map of a Modbus device

Any device that keeps its points in registers needs a map and nothing else. The map says which registers hold what and how they are to be
read. Addresses count from 0, as on the wire: register 40001 of a manual is usually the holding register 0 here. `drivers/maps` holds
the maps that are shipped, to copy from.

```yaml
device: my controller
pattern: latest
points:
  at: 40
  fields:
    sequence: {at: 0, type: uint16}
    x: {at: 1, type: float32}
    y: {at: 3, type: float32}
```

`cmmlink registers`, or *New Modbus device* on [the page](console.md), shows what the registers hold, and writes such a map.

If numbers of two registers come out absurd, add `word_order: low-first`. Coordinates that are not named are 0. Every scale is finite and
not 0, and `true` and `false` are not numbers here.
"""


RESULTS = """
# Results

Every command that takes `--json` prints one object on one line of standard output, and nothing else. Its keys are stable: keys are
added, not renamed. Lengths are in mm, deviations are positive out of material, and coordinates are those of the nominal. `result.json` in
the folder of `--out` holds the same object. Its key `schema` names its version, and [result.schema.json](result.schema.json) is the JSON
schema of it.
"""

GALLERY = """
# Gallery

Every example as it stands in docs/examples: what it shows, its code, and what it prints. A test runs each of them.
"""

PYTHON = """
# In Python

What each package offers by its front door. Names behind it are the package's own and may change. Arrays are float64, lengths mm, angles
radians; what a function takes and gives stands in its docstring, with shapes and units: `help(inspection.register)`. Rows of arrays are
counted from 0; columns of files from 1, as in a plan.

From files or arrays to a verdict in one call, which is that of `cmmlink inspect`:

```python
import cmmlink

found = cmmlink.inspect("docs/examples/data/cam-points.csv", nominal="docs/examples/data/cam.yaml", tolerance=(-0.05, 0.05))
print(found.verdict.word, found.reasons[0])  # nonconform 33 points lie beyond the limits -0.05 .. 0.05 mm.
print(found.points.deviation_mm.shape)  # (800,)
```

`found` shows itself in a notebook; `found.plot()` is a matplotlib figure, `found.to_columns()` and `found.to_dataframe()` are the points
with the columns of deviations.csv, and `found.document` has the keys of result.json.
`cmmlink.inspect_surface("scan.csv", nominal="part.stp", tolerance=(-0.05, 0.05))` does so for points in
space against a whole [surface](surfaces.md). `cmmlink.open_run("last")` gives the same of a
recorded run, and `plan=cmmlink.load_plan("plan.yaml")` stands in place of the other arguments.
[Example 06](examples/06_one_call.py) walks through it, and the [gallery](gallery.md) shows all examples. `make docs` writes what stands
below, with every docstring, as pages for a browser.
"""

OBJECTS: tuple[tuple[str, type[BaseModel], type[BaseModel] | None], ...] = (
    ("Of every inspection", Inspected, None),
    ("`inspect --no-record`: further keys", Measured, Inspected),
    ("`inspect`, `run` and `demo`: further keys", Recorded, Measured),
    ("`inspect` of several files", FilesInspected, None),
    ("`replay`: further keys", Replayed, Inspected),
    ("`rejudge`", ArchiveRejudged, None),
    ("`surface`, and `run` with the plan of a surface", SurfaceInspected, None),
    ("The same with `--no-record`: further keys", SurfaceMeasured, SurfaceInspected),
    ("The same on record: further keys", SurfaceRecorded, SurfaceMeasured),
    ("`replay` of a run of a surface: further keys", SurfaceReplayed, SurfaceInspected),
    ("`ct`", StackInspected, None),
    ("`nominal`", Understood, None),
    ("`runs`", Runs, None),
    ("`show`, and `run.json` of `export`", Shown, None),
    ("`export`", Exported, None),
    ("`report`", Reported, None),
    ("`compare`", Compared, None),
    ("`compare` of two runs of a surface", SurfacesCompared, None),
    ("`verify`", Verified, None),
    ("`verify-zone`", ZonesVerified, None),
    ("`qualify`, and its certificate", Qualified, None),
    ("`key show`; `key new` prints its first three keys", StationKey, None),
    ("`key rotate`", KeyHandedOver, None),
    ("`backup`, `restore` and `merge`", RecordsCopied, None),
    ("`plant push` and `plant status`", PlantOutbox, None),
    ("`plant verify`", PlantAgreement, None),
    ("`plant address`", PlantAddress, None),
    ("`plant trends`", PlantTrend, None),
)

TABLES: tuple[tuple[str, Mapping[str, str]], ...] = (
    (
        "`deviations.csv`: a line for every received point (`ending` only of a run that did not come to its end)",
        deviations_csv.EARLY_COLUMNS,
    ),
    (
        "`deviations.csv` of a surface, and `csv` of `export --format`: a line for every received point (`ending` as above)",
        surface_csv.EARLY_SURFACE_COLUMNS,
    ),
    ("`uncertainty.csv`, where the plan states a budget: a line for every place along the profile", uncertainty_tables.COLUMNS),
    ("`sections.csv` of `ct`: a line for every section", stack_folder.SECTION_COLUMNS),
    ("`stack.csv` of `ct`: a line for every section and characteristic of the stack", stack_folder.STACK_COLUMNS),
    ("`contours.csv` of a section: a line for every contour point", stack_folder.CONTOUR_COLUMNS),
    ("Runs, in `csv` and `xlsx` of `export --format`: a line for every run or section", tables.RUN_COLUMNS),
    ("Characteristics in them: a line for every characteristic", tables.CHARACTERISTIC_COLUMNS),
    ("Points in them: a line for every received point", tables.POINT_COLUMNS),
    ("Runs of an archive, in the table of `rejudge --out`: a line for every run", REJUDGED_COLUMNS),
    ("`points.csv` and `points.npy` of `export`: a line for every point", {**export.POINT_COLUMNS, **export.NORMAL_COLUMNS}),
    ("`wire.csv` of `export`: a line for every read", export.WIRE_COLUMNS),
    ("`chain.csv` of `export`: a line for every record", evidence.CHAIN_COLUMNS),
)


def front_doors() -> str:
    """The names of each package's front door, each with the first sentence of its docstring."""
    parts = []
    for package in (inspection, drivers, simulators, cmmlink):
        rows = [f"| `{name}` | {_first_line(getattr(package, name))} |" for name in package.__all__]
        parts.append(
            "\n".join([f"## `{package.__name__}`", "", _first_line(package), "", "| name | what it is |", "| --- | --- |", *rows, ""])
        )
    return "\n".join([WRITTEN, PYTHON.strip(), "", *parts])


def _first_line(thing: object) -> str:
    """The first sentence of a docstring; of what has none its choices, keys or value."""
    if get_args(thing):
        return "One of " + ", ".join(f"`{getattr(choice, '__name__', choice)}`" for choice in get_args(thing)) + "."
    if isinstance(thing, Mapping):
        return "By their names: " + ", ".join(f"`{key}`" for key in thing) + "."
    if isinstance(thing, Set):
        return "Any of " + ", ".join(f"`{member}`" for member in sorted(thing)) + "."
    if not (inspect.ismodule(thing) or callable(thing)):
        return f"The value `{thing}`."
    return (inspect.getdoc(thing) or "").split("\n\n")[0].replace("\n", " ").replace("|", "\\|")


def page(intro: str, model: type[BaseModel]) -> str:
    """A page of one model: what it is for, and a table for each group of its keys."""
    return "\n".join([WRITTEN, intro.strip(), "", *(_part(group) for group in groups_of(model))])


def named(title: str, meanings: Mapping[str, str]) -> str:
    """A table of names and their meanings under a title."""
    rows = [f"| `{name}` | {meaning[0].upper()}{meaning[1:]}. |" for name, meaning in _without_bars(meanings).items()]
    return "\n".join([f"## {title}", "", "| name | meaning |", "| --- | --- |", *rows, ""])


def _without_bars(meanings: Mapping[str, str]) -> Mapping[str, str]:
    """The meanings as cells of a table, which a | would end."""
    return {name: meaning.replace("|", "\\|") for name, meaning in meanings.items()}


def _part(group: Group) -> str:
    return f"## {f'`{group.path}`' if group.path else 'All keys'}\n\n{group.meaning}\n\n{table(group)}\n"


def results() -> str:
    """The objects of every command, then the columns of every table."""
    described: set[str] = set()  # what an earlier object described
    parts = []
    for title, model, base in OBJECTS:
        known = {field.alias or name for name, field in base.model_fields.items()} if base else set()
        own, *inner = groups_of(model)
        keys = tuple(key for key in own.keys if key.name not in known)
        fresh = [group for group in inner if group.meaning not in described]
        described |= {group.meaning for group in inner}
        parts += [f"## {title}\n\n{own.meaning}\n\n{_holds(replace(own, keys=keys))}\n"]
        parts += [f"### `{group.path}`\n\n{group.meaning}\n\n{_holds(group)}\n" for group in fresh]
    return "\n".join([WRITTEN, RESULTS.strip(), "", *parts, *(named(title, columns) for title, columns in TABLES)])


def _holds(group: Group) -> str:
    """The table of an object that is printed: what JSON calls an object is a mapping in YAML."""
    return table(group, defaults=False).replace("a mapping", "an object").replace("a list of mappings", "a list of objects")


def _plan() -> str:
    """The keys of a plan, and the formats that a serial device may have, with the options of each."""
    rows = []
    for name, make in sorted(decoders().items()):
        parameters = inspect.signature(make).parameters.values()
        options = [f"`{each.name}`{' (required)' if each.default is each.empty else ''}" for each in parameters]
        rows.append(f"| `{name}` | {', '.join(options) or 'none'} | {(inspect.getdoc(make) or '').splitlines()[0]} |")
    formats = ["## Formats of `device (type: serial)`", "", "| format | options | what it reads |", "| --- | --- | --- |", *rows, ""]
    return "\n".join([page(PLAN, Plan), *formats])


def _register_map() -> str:
    fields = [
        named("Names in the block `status`", STATUS_FIELDS),
        named("Names in the block `pop`", POP_FIELDS),
        named("Names in the block `points`", POINTS_FIELDS),
    ]
    return "\n".join([page(REGISTER_MAP, RegisterMap), named("The four patterns", PATTERNS), *fields])


def qualification() -> str:
    """The page with the table of limits written anew."""
    head, _, rest = (DOCS / "qualification.md").read_text(encoding="utf-8").partition("| --- |\n")
    _, _, tail = rest.partition("\n\n")
    rows = [
        f"| {one.kind} | {one.name} | {one.limit:g}{' ' * bool(one.limit)}{one.unit * bool(one.limit)} | {one.reason} |"
        for one in QUANTITIES
    ]
    return f"{head}| --- |\n" + "\n".join(rows) + f"\n\n{tail}"


def gallery() -> str:
    """Every example with its docstring as the text, and its code; a test runs each and holds it to what it says that it prints."""
    scripts = sorted([*EXAMPLES.glob("[0-9]*.py"), *EXAMPLES.glob("[0-9]*/*.py")], key=lambda script: script.relative_to(EXAMPLES).parts)
    return "\n".join([WRITTEN, GALLERY.strip(), *map(_example, scripts)])


def _example(script: Path) -> str:
    text = script.read_text(encoding="utf-8")
    told, code = inspect.cleandoc(ast.get_docstring(ast.parse(text)) or ""), text.split('"""', 2)[2].strip()
    title, _, rest = told.partition("\n")
    said, _, printed = rest.strip().partition("It prints:")
    place = script.relative_to(DOCS).as_posix()
    parts = [f"\n## {script.relative_to(EXAMPLES).parts[0][:2]}: {title.rstrip('.')}", said.strip(), f"[{script.name}]({place})"]
    parts += [f"```py\n{code}\n```", f"prints\n\n```text\n{inspect.cleandoc(printed)}\n```"]
    return "\n\n".join(part for part in parts if part) + "\n"


def result_schema() -> str:
    """The JSON schema of result.json. Keys may be added without another version, so a reader has to pass over what it does not know."""
    found: dict[str, Any] = TypeAdapter(
        Recorded | Measured | Replayed | SurfaceRecorded | SurfaceMeasured | SurfaceReplayed | StackInspected
    ).json_schema()
    for model in found["$defs"].values():
        if "properties" in model:
            model.pop("additionalProperties", None)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": RESULT_SCHEMA, "title": "The result of cmmlink, result.json"}
    return json.dumps(head | found, indent=1) + "\n"


PAGES: dict[str, Callable[[], str]] = {
    "plan.md": _plan,
    "ct-plan.md": lambda: page(CT_PLAN, CtPlan),
    "surface-plan.md": lambda: page(SURFACE_PLAN, SurfacePlan),
    "register-map.md": _register_map,
    "results.md": results,
    "result.schema.json": result_schema,
    "python.md": front_doors,
    "gallery.md": gallery,
    "qualification.md": qualification,
}

if __name__ == "__main__":
    for name, write in PAGES.items():
        (DOCS / name).write_text(write(), encoding="utf-8")
