"""A nominal as IGES 5.3: one rational B-spline curve (entity 126) in the plane z = 0."""

from cmmlink.reference.case import CaseUnit, ReferenceNominal
from cmmlink.reference.real_numbers import real, weights_of

_UNITS = {"inch": "1,4HINCH", "mm": "2,2HMM"}
_DATE = "15H20261127.000000"
_KIND = 126


def iges_text(nominal: ReferenceNominal, unit: CaseUnit, name: str) -> str:
    """The text of the file."""
    size = max(abs(float(each)) for each in nominal.control_points.ravel())
    parts = (
        "1H,,1H;",
        _string(name),
        _string(f"{name}.igs"),
        _string("cmmlink reference set"),
        "1H1,32,38,6,308,15",
        _string(name),
        f"1.,{_UNITS[unit]},1,0.1",
        _DATE,
        f"0.00000001,{real(size)},7Hcmmlink,7Hcmmlink,11,0",
        _DATE,
    )
    parameters = _cut(f"{_KIND},{_parameters(nominal)};".split(","), 64)
    directory = [
        "".join(f"{value:>8}" for value in (_KIND, 1, 0, 1, 0, 0, 0, 0)) + f"{'00000000':>8}",
        "".join(f"{value:>8}" for value in (_KIND, 0, 0, len(parameters), 0)),
    ]
    sections = {
        "S": ["cmmlink reference set, dedicated to the public domain (CC0 1.0)"],
        "G": _cut(f"{','.join(parts)};".split(","), 72, "G"),
        "D": directory,
        "P": [f"{line:<64}{1:>8}" for line in parameters],
    }
    sections["T"] = ["".join(f"{letter}{len(lines):>7}" for letter, lines in sections.items())]
    return "".join(f"{line:<72}{letter}{i:>7}\n" for letter, lines in sections.items() for i, line in enumerate(lines, 1))


def _string(text: str) -> str:
    return f"{len(text)}H{text}"


def _parameters(nominal: ReferenceNominal) -> str:
    points = [real(value) for x, y in nominal.control_points for value in (x, y, 0.0)]
    first, last = nominal.knots[nominal.degree], nominal.knots[-nominal.degree - 1]
    ends = [real(value) for value in (first, last, 0.0, 0.0, 1.0)]  # of the parameter, and the normal of the plane
    flags = (1, int(nominal.closed), int(nominal.weights is None), 0)  # planar, closed, polynomial, not periodic
    head = (len(nominal.control_points) - 1, nominal.degree, *flags)
    return ",".join([*map(str, head), *map(real, nominal.knots), *map(real, weights_of(nominal)), *points, *ends])


def _cut(words: list[str], width: int, section: str = "P") -> list[str]:
    """Lines up to a width, of words that no line cuts; a text of the global section may hold a comma of its own, and is cut anywhere."""
    if section == "G":
        text = ",".join(words)
        return [text[i : i + width] for i in range(0, len(text), width)]
    lines = [""]
    for i, word in enumerate(words):
        piece = word if i == len(words) - 1 else f"{word},"
        if len(lines[-1]) + len(piece) > width:
            lines.append("")
        lines[-1] += piece
    return lines
