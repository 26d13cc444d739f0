"""What an IGES file says, entity by entity: eighty columns of text in five sections, and parameters as a free stream.

Columns 1 to 72 hold data, 73 the letter of the section, 74 to 80 a number; of parameters columns 1 to 64 only. Strings are spelt with
their length, like 5Hhello, and may hold delimiters and run over lines.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from drivers import shorten
from inspection import NominalError

_DATA, _PARAMETER_DATA = 72, 64
_MOST_ENTITIES = 200_000
_STRING = re.compile(r"\s*(\d+)H")


@dataclass(frozen=True, slots=True)
class Entity:
    """One entity: its place in the directory, and its parameters as they are spelt.

    number     : the number of its first line in the directory, by which others point to it
    kind, form : the number of its type, like 126, and of its form
    transform  : the number of the matrix that places it, 0 for none
    level      : the level it is drawn on; negative numbers point to a list of levels
    hidden     : whether it is not to be seen
    dependent  : whether it is a part of another entity, and is drawn with it alone
    use        : what it is for: 0 geometry, 1 annotation, 5 a curve on a surface, 6 construction
    parameters : behind the number of the type; empty ones mean their default
    """

    number: int
    kind: int
    form: int
    transform: int
    level: int
    hidden: bool
    dependent: bool
    use: int
    parameters: tuple[str, ...]

    @property
    def name(self) -> str:
        """What messages call it."""
        return f"entity {self.kind} (D{self.number})"

    def real(self, i: int, default: float | None = None) -> float:
        """The number at a place of the parameters, from 0. Raises NominalError where none can be read."""
        text = self.parameters[i] if i < len(self.parameters) else ""
        if not text and default is not None:
            return default
        if not text and i < len(self.parameters):
            return 0.0
        try:
            return float(text.replace("D", "E").replace("d", "e"))
        except ValueError:
            found = f"'{shorten(text)}'" if text else "nothing"
            raise NominalError(f"{self.name}: {found} stands for parameter {i + 1}; expected a number") from None

    def reals(self, first: int, count: int) -> list[float]:
        """So many numbers from a place on."""
        if first + count > len(self.parameters):
            raise NominalError(f"{self.name}: {len(self.parameters)} parameters; expected at least {first + count}: is the file cut off?")
        return [self.real(i) for i in range(first, first + count)]

    def whole(self, i: int, default: int | None = None) -> int:
        """The whole number at a place."""
        value = self.real(i, default)
        if value != int(value):
            raise NominalError(f"{self.name}: {value:g} stands for parameter {i + 1}; expected a whole number")
        return int(value)


@dataclass(frozen=True, slots=True)
class IgesFile:
    """The global parameters, numbered from 1 as the standard does, and the entities by the number of their first directory line."""

    settings: dict[int, str]
    entities: dict[int, Entity]


def parse_iges(text: str) -> IgesFile:
    """Read the five sections. Raises NominalError for what is no IGES file, or one that was cut off."""
    sections = _sections(text)
    settings, parameter_end, record_end = _settings("".join(line[:_DATA] for line in sections["G"]))
    _require_end(sections)
    directory = sections["D"]
    if len(directory) % 2:
        raise NominalError(f"{len(directory)} lines of the directory; expected two for each entity: is the file cut off?")
    if len(directory) > 2 * _MOST_ENTITIES:
        raise NominalError(f"{len(directory) // 2} entities; expected a drawing of a profile: export it alone")
    entities = {}
    for i in range(0, len(directory), 2):
        entity = _entity(i + 1, directory[i], directory[i + 1], sections["P"], parameter_end, record_end)
        entities[entity.number] = entity
    return IgesFile(settings, entities)


def _sections(text: str) -> dict[str, list[str]]:
    sections: dict[str, list[str]] = {letter: [] for letter in "SGDPT"}
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.ljust(80)
        letter = line[_DATA]
        if letter in sections:
            sections[letter].append(line)
        elif letter in ("C", "B") and number == 1:
            raise NominalError("is IGES in its compressed or binary form; export it as fixed ASCII, which every program writes")
        elif raw.strip():
            raise NominalError(
                f"line {number}: '{shorten(raw.strip())}' is no line of IGES; expected 80 columns, with S, G, D, P or T in column 73"
            )
    for letter, name in (("G", "global section"), ("D", "directory"), ("P", "parameters")):
        if not sections[letter]:
            raise NominalError(f"has no {name}; expected a whole IGES file: is it cut off?")
    return sections


def _require_end(sections: dict[str, list[str]]) -> None:
    """Refuse a file without its last line, or with another number of lines than that line says: curves would be missing silently."""
    if not sections["T"]:
        raise NominalError("has no last line (T); expected a whole IGES file: it is cut off")
    announced = {field[0]: field[1:].strip() for field in (sections["T"][0][i : i + 8] for i in range(0, 32, 8)) if field.strip()}
    for letter, name in (("D", "directory"), ("P", "parameters")):
        told = announced.get(letter, "")
        if told.isdecimal() and int(told) != len(sections[letter]):
            raise NominalError(f"{len(sections[letter])} lines of the {name}, where the last line announces {told}; export the file again")


def _settings(stream: str) -> tuple[dict[int, str], str, str]:
    """The global parameters, and the two delimiters, which the first two of them may change."""
    parameter_end, record_end, rest = ",", ";", stream
    if own := re.match(r"\s*1H(.)", rest):
        parameter_end, rest = own[1], rest[own.end() :]
    if not rest.lstrip().startswith(parameter_end):
        raise NominalError(f"the global section begins with '{shorten(stream[:20])}'; expected the two delimiters of IGES")
    rest = rest.lstrip()[1:]
    if own := re.match(r"\s*1H(.)", rest):
        record_end, rest = own[1], rest[own.end() :]
    if not rest.lstrip().startswith((parameter_end, record_end)):
        raise NominalError(f"the global section begins with '{shorten(stream[:20])}'; expected the two delimiters of IGES")
    rest = rest.lstrip()[1:]
    return dict(enumerate(_parameters(rest, parameter_end, record_end), 3)), parameter_end, record_end


def _parameters(stream: str, parameter_end: str, record_end: str) -> Iterator[str]:
    """The parameters up to the end of the record; strings without their length. Raises NominalError where the record has no end."""
    at = 0
    while at < len(stream):
        if string := _STRING.match(stream, at):
            end = string.end() + int(string[1])
            value, at = stream[string.end() : end], end
            skipped = re.compile(r"\s*").match(stream, at)
            at = skipped.end() if skipped else at
        else:
            ends = [place for place in (stream.find(parameter_end, at), stream.find(record_end, at)) if place >= 0]
            if not ends:
                break
            value, at = stream[at : min(ends)].strip(), min(ends)
        yield value
        if at < len(stream) and stream[at] == record_end:
            return
        if at < len(stream) and stream[at] != parameter_end:
            break
        at += 1
    raise NominalError(
        f"a record has no end '{record_end}', behind '{shorten(stream[max(0, len(stream.rstrip()) - 20) :].strip())}'; is the file cut off?"
    )


def _entity(number: int, first: str, second: str, parameters: list[str], parameter_end: str, record_end: str) -> Entity:
    one, two = ([line[i : i + 8].strip() for i in range(0, _DATA, 8)] for line in (first, second))

    def field(text: str, default: int = 0) -> int:
        try:
            return int(text or default)
        except ValueError:
            raise NominalError(
                f"line D{number}: '{shorten(text)}' stands where a whole number is expected; export the file again"
            ) from None

    kind, start, count = field(one[0]), field(one[1]), field(two[3], 1)
    if not 0 < start <= start - 1 + count <= len(parameters):
        raise NominalError(
            f"entity {kind} (D{number}): its parameters lie in lines {start} to {start - 1 + count} of {len(parameters)}; "
            "is the file cut off?"
        )
    stream = "".join(line[:_PARAMETER_DATA] for line in parameters[start - 1 : start - 1 + count])
    values = list(_parameters(stream, parameter_end, record_end))
    if not values or values[0] != str(kind):
        found = shorten(values[0]) if values else ""
        raise NominalError(
            f"entity {kind} (D{number}): its parameters begin with '{found}'; expected the number of its type: export the file again"
        )
    status = one[8].rjust(8, "0")
    digits = [field(status[i : i + 2].strip()) for i in (0, 2, 4)]
    return Entity(
        number, kind, field(two[4]), field(one[6]), field(one[4]), digits[0] == 1, digits[1] in (1, 3), digits[2], tuple(values[1:])
    )
