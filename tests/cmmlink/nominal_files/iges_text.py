"""IGES files written by hand, as the standard lays them out: what no program of ours wrote."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from tests.cmmlink.nominal_files.wire import CENTER, ELLIPSE_CENTER, LINES, POLES, RADIUS, SEMI_X, SEMI_Y, WEIGHTS

DATE = "15H20261127.120000"
MM = f"1H,,1H;,4Hpart,8Hpart.igs,3Hcad,1H1,32,38,6,308,15,4Hpart,1.,2,2HMM,1,0.,{DATE},1D-7,1000.,2Hme,2Hus,11,0,{DATE};"


@dataclass(frozen=True)
class Given:
    """One entity as it is to be written: its parameters behind the type, as text."""

    kind: int
    parameters: str
    form: int = 0
    transform: int = 0
    level: int = 0
    status: str = "00000000"


@dataclass
class Text:
    """The lines of a file under construction."""

    directory: list[str] = field(default_factory=list)
    parameters: list[str] = field(default_factory=list)


def iges(entities: Sequence[Given], settings: str = MM, end: str = ";", last_line: bool = True) -> str:
    """The text of a file; entity number i has the directory number 2 i + 1."""
    text = Text()
    for i, given in enumerate(entities):
        pointer = 2 * i + 1
        stream = f"{given.kind}{end_of_type(settings)}{given.parameters}{end}"
        lines = [stream[j : j + 64] for j in range(0, len(stream), 64)]
        first = (given.kind, len(text.parameters) + 1, 0, 1, given.level, 0, given.transform, 0)
        text.directory.append("".join(f"{value:>8}" for value in first) + f"{given.status:>8}")
        text.directory.append(f"{given.kind:>8}{0:>8}{0:>8}{len(lines):>8}{given.form:>8}".ljust(72))
        text.parameters += [f"{line:<64}{pointer:>8}" for line in lines]
    sections = {
        "S": ["by hand"],
        "G": [settings[j : j + 72] for j in range(0, len(settings), 72)],
        "D": text.directory,
        "P": text.parameters,
    }
    if last_line:
        sections["T"] = ["".join(f"{letter}{len(lines):>7}" for letter, lines in sections.items())]
    return "".join(f"{line:<72}{letter}{i:>7}\n" for letter, lines in sections.items() for i, line in enumerate(lines, 1))


def end_of_type(settings: str) -> str:
    return settings[2] if settings.startswith("1H") else ","


def numbers(*values: float) -> str:
    return ",".join(repr(float(value)) for value in values)


def spline_parameters(
    degree: int, knots: Sequence[float], weights: Sequence[float], points: Sequence[Sequence[float]], used: Sequence[float]
) -> str:
    flat = [value for x, y in points for value in (x, y, 0.0)]
    return f"{len(points) - 1},{degree},0,0,1,0,{numbers(*knots, *weights, *flat, *used)},0.,0.,1."


def wire_entities(level: int = 0, status: str = "00000000") -> list[Given]:
    """The wire: lines, an arc, the rational cubic, and the ellipse as a conic whose axes are turned by its coefficients."""
    (cx, cy), (ex, ey) = CENTER, ELLIPSE_CENTER
    a, c = 1 / SEMI_X**2, 1 / SEMI_Y**2
    conic = numbers(a, 0, c, -2 * a * ex, -2 * c * ey, a * ex * ex + c * ey * ey - 1, 0, ex, ey + SEMI_Y, ex - SEMI_X, ey)
    given = [Given(110, numbers(*one, 0, *other, 0)) for one, other in LINES]
    given.append(Given(100, numbers(0, cx, cy, cx, cy - RADIUS, cx, cy + RADIUS)))
    given.append(Given(126, spline_parameters(3, [0, 0, 0, 0, 1, 1, 1, 1], WEIGHTS, POLES, (0, 1))))
    given.append(Given(104, conic, form=1))
    return [Given(one.kind, one.parameters, one.form, 0, level, status) for one in given]
