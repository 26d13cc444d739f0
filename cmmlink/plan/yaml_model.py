"""YAML text to a validated pydantic model, with the line of every key at hand for the message when it is wrong.

Only what a plan needs is YAML here: mappings, sequences, scalars. Tags, anchors and aliases, repeated keys and deep
nesting are refused, so a file can neither build objects nor blow up. A scalar stays text until the model says what it is:
a serial number 0012 keeps its zeros, 1e-4 is a number, `null`, `~` and nothing are None.
"""

import difflib
import re
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any, NoReturn, TypeVar

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from cmmlink.errors import YamlError

Path = tuple[str | int, ...]
_IN_OUR_WORDS = {
    "float_parsing": "a number",
    "float_type": "a number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number of fewer digits",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "string_too_short": "some text",
    "string_type": "text",
    "too_short": "a longer list",
    "path_type": "a path",
    "tuple_type": "a list in brackets",
    "list_type": "a list in brackets",
}
Model = TypeVar("Model", bound=BaseModel)
Positive = Annotated[float, Field(gt=0)]


def _on_one_line(text: str) -> str:
    if not text.isprintable():
        raise ValueError("printable text on one line")
    return text


Text = Annotated[str, Field(min_length=1), AfterValidator(_on_one_line)]

_DEEPEST = 20
_NULL = ("", "~", "null", "Null", "NULL")
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml where the wheel has it: a hundred times faster on long lists
# Too deep, as far as brackets alone tell: they open more often than is allowed before one closes.
_MANY_BRACKETS = re.compile(rf"[\[{{](?:[^\[\]{{}}]*[\[{{]){{{_DEEPEST}}}")


class Settings(BaseModel):
    """Base of all groups of keys: immutable, unknown keys refused, numbers finite, blanks around text removed."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, str_strip_whitespace=True, serialize_by_alias=True, validate_by_name=True
    )


@dataclass(frozen=True, slots=True)
class Mistake:
    """What is wrong in a YAML text: the line, words for it, and the key that is meant, of the model whose key it is."""

    line: int
    words: str
    model: type[BaseModel] | None
    key: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.words}"


def read_model(text: str, model: type[Model]) -> Model:
    """Validate a YAML text against a model. Raises YamlError: line, key, the value found, what is allowed."""
    document = _read(text)
    try:
        return model.model_validate(document.value)
    except ValidationError as failure:
        mistakes = _mistakes(failure, document, model)
    others = f" (and {len(mistakes) - 1} more after this one)" if len(mistakes) > 1 else ""
    raise YamlError(f"{mistakes[0]}{others}")


def mistakes_in(text: str, model: type[BaseModel]) -> tuple[Mistake, ...]:
    """All that is wrong in a YAML text, misspelt keys first. Raises YamlError where it is no YAML of keys with values."""
    document = _read(text)
    try:
        model.model_validate(document.value)
    except ValidationError as failure:
        return tuple(_mistakes(failure, document, model))
    return ()


def value_of(text: str) -> Any:
    """What a key has as its value that this text stands behind, as a model takes it. Raises YamlError where it is no value."""
    document = _read(f"value: {text}")
    if set(document.value) != {"value"}:
        raise YamlError("more than one value; expected one, on one line")
    return document.value["value"]


def texts_of(text: str) -> dict[str, tuple[int, str]]:
    """The line and the text of every value that is a text, by its dotted key; those of a list are left out. Raises YamlError."""
    document = _read(text)
    found: dict[str, tuple[int, str]] = {}
    for path, line in document.lines.items():
        value: Any = document.value
        for part in path:
            value = value[part]
        if isinstance(value, str) and all(isinstance(part, str) for part in path):
            found[".".join(map(str, path))] = (line, value)
    return found


def _mistakes(failure: ValidationError, document: "_Document", model: type[BaseModel]) -> list[Mistake]:
    """Name a misspelt key first, and not the right one as well, which is missing for the same mistake."""
    errors = sorted(failure.errors(), key=lambda error: error["type"] not in ("extra_forbidden", "unknown_name"))
    told = [(error["type"], _explain(error, document, model)) for error in errors]
    misspelt = {(mistake.model, mistake.key) for kind, mistake in told if kind == "extra_forbidden"}
    return [mistake for kind, mistake in told if kind != "missing" or (mistake.model, mistake.key) not in misspelt]


def line_of(text: str, key: str) -> int:
    """Line of a dotted key in a text that was read before; where the key is not written, the line of the group that it belongs to."""
    lines = _read(text).lines
    path: Path = tuple(int(part) if part.isdigit() else part for part in key.split("."))
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 1)


@dataclass(slots=True)
class _Document:
    """Plain values of a YAML text, and the line of each by its path."""

    value: Any = None
    lines: dict[Path, int] = field(default_factory=dict)


class _StopAtDepth(yaml.SafeLoader):
    """The reader in Python, stopped by our limit of nesting while it reads ahead.

    It and libyaml read up to 1,024 characters ahead of the events that they hand out: brackets in a row cost the one half a second,
    and the other meets a limit of its own there.
    """

    def fetch_flow_collection_start(self, TokenClass: Any) -> None:
        """Count a bracket that opens."""
        super().fetch_flow_collection_start(TokenClass)
        if self.flow_level > _DEEPEST + 1:
            raise YamlError(f"line {self.line + 1}: nested more than {_DEEPEST} deep")


def _read(text: str) -> _Document:
    document = _Document()
    events = yaml.parse(text, Loader=_StopAtDepth if _MANY_BRACKETS.search(text) else _LOADER)
    try:
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if document.lines:
                    _refuse(event, "a second document begins; expected one")
                document.value = _node(next(events), events, (), document)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise YamlError(f"line {mark.line + 1 if mark else 1}: not valid YAML: {error.problem or error.context}") from None
    except yaml.YAMLError as error:
        raise YamlError(f"not valid YAML: {str(error).splitlines()[0]}") from None
    if not isinstance(document.value, dict):
        found = "nothing" if document.value is None else _shorten(document.value)
        raise YamlError(f"line {document.lines.get((), 1)}: found {found}; expected keys with values, like 'part: ...'")
    return document


def _node(event: yaml.Event, events: Iterator[yaml.Event], path: Path, document: _Document) -> Any:
    """Value of the node that begins with this event."""
    if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
        _refuse(event, "anchors (&) and aliases (*) are not supported; write the value out")
    if getattr(event, "tag", None) not in (None, "!"):
        _refuse(event, f"the tag {getattr(event, 'tag', '')} is not supported; write the plain value")
    if len(path) > _DEEPEST:
        _refuse(event, f"nested more than {_DEEPEST} deep")
    document.lines.setdefault(path, _line(event))
    if isinstance(event, yaml.MappingStartEvent):
        return _mapping(events, path, document)
    if isinstance(event, yaml.SequenceStartEvent):
        items: list[Any] = []
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            items.append(_node(event, events, (*path, len(items)), document))
        return items
    assert isinstance(event, yaml.ScalarEvent)
    return None if not event.style and event.value in _NULL else event.value  # the style is None for text without quotes


def _mapping(events: Iterator[yaml.Event], path: Path, document: _Document) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    while not isinstance(event := next(events), yaml.MappingEndEvent):
        if not isinstance(event, yaml.ScalarEvent):
            _refuse(event, "a key must be a single word")
        key = str(event.value)
        if key in mapping:
            _refuse(event, f"{_key_text((*path, key))} is given twice, first on line {document.lines[(*path, key)]}")
        document.lines[(*path, key)] = _line(event)
        mapping[key] = _node(next(events), events, (*path, key), document)
    return mapping


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


def _refuse(event: yaml.Event, problem: str) -> NoReturn:
    raise YamlError(f"line {_line(event)}: {problem}")


def _explain(error: ErrorDetails, document: _Document, model: type[BaseModel]) -> Mistake:
    """One complaint of pydantic's in our words."""
    path, owner, takes = _place(error["loc"], document, model)
    line, words = _words_on(error, path, owner, takes, document)
    meant = str(path[-1]) if path else ""
    if error["type"] == "extra_forbidden":
        meant = next(iter(difflib.get_close_matches(meant, _keys(owner), n=1)), "")
    return Mistake(line, words, owner, meant)


def _words_on(error: ErrorDetails, path: Path, owner: type[BaseModel] | None, takes: Any, document: _Document) -> tuple[int, str]:
    """Line and message."""
    line = document.lines.get(path) or document.lines.get(path[:-1]) or 1
    key, found = _key_text(path), _shorten(error["input"])
    kind = error["type"]
    if kind == "extra_forbidden" and str(path[-1]).isdigit():
        return line, f"{key} is not a known key; is it what stands behind a decimal comma? Expected decimal points"
    if kind == "extra_forbidden":
        return line, f"{key} is not a known key;{_did_you_mean(str(path[-1]), _keys(owner))}"
    if kind == "unknown_name":
        return line, f"{key} is not a known key;{_did_you_mean(str(path[-1]), error['ctx']['allowed'].split(', '))}"
    if kind == "missing":
        return line, f"{key} is missing: expected {_meaning(owner, str(path[-1]))}"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        tag = error["input"].get("type") if isinstance(error["input"], dict) else None
        problem = f"is {_shorten(tag)};" if tag else "is missing;"
        return document.lines.get((*path, "type"), line), f"{key}.type {problem}{_did_you_mean(str(tag), _tags(takes))}"
    return line, f"{key} is {found}; expected {_expectation(error, owner, path)}"


def _expectation(error: ErrorDetails, owner: type[BaseModel] | None, path: Path) -> str:
    """Say what the model takes at a key, in our words where pydantic speaks of Python."""
    kind = error["type"]
    if kind in ("model_type", "model_attributes_type"):
        known = _field(owner, str(path[-1]))
        return f"a mapping with {', '.join(_keys(_models(known.annotation)[0]))}" if known else "a mapping"
    if kind == "float_parsing" and re.fullmatch(r"\s*[+-]?\d+,\d+\s*", str(error["input"])):
        return "a number, with a decimal point"
    return words_of_allowed(error)


def words_of_allowed(error: ErrorDetails) -> str:
    """What pydantic would have taken in place of a wrong value, in our words where it speaks of Python."""
    allowed = re.sub(r"^(Value error, |Input should be )", "", error["msg"])
    return _IN_OUR_WORDS.get(error["type"]) or re.sub(r"^(greater|less) than", r"a number \1 than", allowed)


def _place(location: tuple[str | int, ...], document: _Document, model: type[BaseModel]) -> tuple[Path, type[BaseModel] | None, Any]:
    """Path in the text of a pydantic location (which also names the chosen type of a union), the model of its last key, and its type."""
    path: Path = ()
    here: Any = model
    owner: type[BaseModel] | None = model
    for part in location:
        if part == "[key]":  # what is wrong is the key itself
            continue
        if typing.get_origin(here) is dict:
            owner, here, path = None, typing.get_args(here)[1], (*path, part)
            continue
        if isinstance(part, int):  # the place in a list, all of whose items are of one kind
            owner, here, path = None, typing.get_args(here)[0] if typing.get_origin(here) is tuple else None, (*path, part)
            continue
        chosen = [choice for choice in _models(here) if type_of(choice) == part]
        if (*path, part) not in document.lines and chosen:
            here = chosen[0]
            continue
        owner = next(iter(_models(here)), None)
        known = _field(owner, str(part))
        here = known.annotation if known else None
        path = (*path, part)
    return path, owner, here


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Every model in an annotation, those of lists and mappings among them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in typing.get_args(annotation) for model in models_in(argument)]


def type_of(model: type[BaseModel]) -> str | None:
    """The value of `type` that tells a model from others that may stand in its place; None where it has none."""
    kind = model.model_fields.get("type")
    return typing.get_args(kind.annotation)[0] if kind else None


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Find the models in an annotation: itself, or the members of a union."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    if typing.get_origin(annotation) in (typing.Union, types.UnionType, typing.Annotated):
        return [model for argument in typing.get_args(annotation) for model in _models(argument)]
    return []


def _tags(takes: Any) -> list[str]:
    """List the values of `type` where one of several models may stand."""
    return [tag for model in _models(takes) if (tag := type_of(model))]


def _keys(model: type[BaseModel] | None) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()] if model else []


def _field(model: type[BaseModel] | None, key: str) -> FieldInfo | None:
    """What a model says of a key, by the name that stands in a text."""
    fields = model.model_fields if model else {}
    return next((field for name, field in fields.items() if key in (name, field.alias)), None)


def _meaning(model: type[BaseModel] | None, key: str) -> str:
    known = _field(model, key)
    return known.description if known and known.description else "a value"


def _did_you_mean(word: str, allowed: list[str]) -> str:
    close = difflib.get_close_matches(word, allowed, n=1)
    return (f" did you mean {close[0]}?" if close else "") + f" Allowed: {', '.join(allowed)}"


def _key_text(path: Path) -> str:
    """Spell a path as device.address or knots[3]."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".") or "the text"


def _shorten(value: Any) -> str:
    if value is None:
        return "empty"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    text = str(value).replace("\n", "\\n")
    return f"'{text if len(text) <= 40 else text[:37] + '...'}'"
