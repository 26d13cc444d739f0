"""The keys of a model as a person reads them: what each takes, its default, and what it means.

The one source is the model itself: its JSON schema, which pydantic makes of types, limits, defaults and descriptions. The pages
docs/plan.md, ct-plan.md, register-map.md and results.md are written from what is given here.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import yaml
from pydantic import BaseModel

REQUIRED = "required"


@dataclass(frozen=True, slots=True)
class Key:
    """One key: what it takes, its default as YAML or `required`, and what it means."""

    name: str
    takes: str
    default: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Group:
    """The keys that stand together: of the whole text (path empty), or below a dotted key like registration.datum.

    Where several kinds of mapping may stand at one key, each has its group, with a path like `device (type: serial)`. Where keys
    beside each other take the same kind of mapping, they share a group, with a path like `status, pop, points`.
    """

    path: str
    meaning: str
    keys: tuple[Key, ...]


def groups_of(model: type[BaseModel], mode: str = "validation") -> tuple[Group, ...]:
    """Describe all keys of a model: its own, then those of each mapping in it, every kind of mapping once."""
    schema = _merge_equal(model.model_json_schema(mode="serialization" if mode == "serialization" else "validation"))
    definitions: Mapping[str, Any] = schema.get("$defs", {})
    places: dict[str, str] = {}  # of each definition: the path under which it is described
    waiting: list[tuple[str, Mapping[str, Any]]] = [("", schema)]
    found = []
    while waiting:
        path, mapping = waiting.pop(0)
        inner: dict[str, list[str]] = {}
        for name, key in mapping["properties"].items():
            here = f"{re.split('[ ,]', path)[0]}.{name}".lstrip(".")
            for place, definition in _mappings(here, key, definitions):
                if definition not in places:
                    inner.setdefault(definition, []).append(place)
        places |= {definition: ", ".join(beside) for definition, beside in inner.items()}
        keys = tuple(_key(name, key, name in mapping.get("required", ()), places) for name, key in mapping["properties"].items())
        found.append(Group(path, _join_lines(mapping.get("description", "")), keys))
        waiting = [(places[definition], definitions[definition]) for definition in inner] + waiting
    return tuple(found)


def _merge_equal(schema: Mapping[str, Any]) -> Mapping[str, Any]:
    """Let one definition stand for all that say the same, so that they are described once."""
    text, first = json.dumps(schema), dict[str, str]()
    for name, definition in schema.get("$defs", {}).items():
        said = json.dumps(definition, sort_keys=True)
        text = text.replace(f'"#/$defs/{name}"', f'"#/$defs/{first.setdefault(said, name)}"')
    return dict(json.loads(text))


def table(group: Group, *, defaults: bool = True) -> str:
    """Write the keys of a group as a table in Markdown."""
    head = ("key", "takes", "default", "meaning") if defaults else ("key", "holds", "meaning")
    rows = [(f"`{key.name}`", key.takes, *([key.default] if defaults else []), _sentence(key.meaning)) for key in group.keys]
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _mappings(path: str, key: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """The mappings that may stand at a key: the path of each, and its name among the definitions."""
    choices = [choice for choice in _choices(key) if choice.get("type") != "null"]
    several = len([choice for choice in choices if "$ref" in choice]) > 1
    for choice in choices:
        if "$ref" in choice:
            name = _definition(choice)
            kind = definitions[name]["properties"].get("type", {}).get("const") if several else None
            yield (f"{path} (type: {kind})" if kind else path), name
        elif choice.get("type") == "array":
            yield from _mappings(f"{path}[]", choice.get("items", {}), definitions)
        elif "$ref" in _values(choice):
            yield f"{path}.NAME", _definition(_values(choice))


def _key(name: str, key: Mapping[str, Any], required: bool, places: Mapping[str, str]) -> Key:
    takes = " or ".join(dict.fromkeys(_takes(choice, places) for choice in _choices(key))).replace(" or a mapping, see ", " or ")
    return Key(name, takes, REQUIRED if required else _default(key), _join_lines(key.get("description", "")))


def _choices(key: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The alternatives that a key takes; those of an alternative that is a choice itself stand beside the others."""
    alternatives = key.get("anyOf") or key.get("oneOf")
    return [inner for choice in alternatives for inner in _choices(choice)] if alternatives else [key]


def _takes(choice: Mapping[str, Any], places: Mapping[str, str]) -> str:
    """Say in words what one alternative takes."""
    if "$ref" in choice:
        return f"a mapping, see `{places[_definition(choice)]}`"
    if "const" in choice:
        return f"`{choice['const']}`"
    if "enum" in choice:
        return ", ".join(f"`{word}`" for word in choice["enum"])
    kind = choice.get("type")
    if kind == "array":
        return _list(choice, places)
    if kind == "object":
        return f"a mapping, see `{places[_definition(_values(choice))]}`" if "$ref" in _values(choice) else "a mapping"
    if kind in ("number", "integer"):
        return _number("number" if kind == "number" else "whole number", choice)
    plain = {"boolean": "`true` or `false`", "null": "`null`", "string": "a path" if choice.get("format") == "path" else "text"}
    return plain.get(str(kind), "any value")


def _list(choice: Mapping[str, Any], places: Mapping[str, str]) -> str:
    if "prefixItems" in choice:
        return f"a list of {len(choice['prefixItems'])} numbers"
    items: Mapping[str, Any] = choice.get("items", {})
    kinds = [_definition(item) for item in _choices(items) if "$ref" in item]
    if kinds:
        see = f"`{places[kinds[0]]}`" if len(kinds) == 1 else f"`{places[kinds[0]].partition(' ')[0]}` of each type"
        return f"a list of mappings, see {see}"
    return {"number": "a list of numbers", "string": "a list of texts", "array": "a list of lists"}.get(str(items.get("type")), "a list")


def _number(word: str, choice: Mapping[str, Any]) -> str:
    """A number with its limits, like `number from 0 to 1` or `number above 0`."""
    low, high = choice.get("minimum"), choice.get("maximum")
    above, below = choice.get("exclusiveMinimum"), choice.get("exclusiveMaximum")
    if low is not None and high is not None:
        return f"{word} from {low:g} to {high:g}" if high < 1e5 else f"{word} from {low:g} to {high:,}"
    if low is not None:
        return f"{word}, {low:g} or more"
    if above is not None:
        return f"{word} above {above:g}" + (f" and below {below:g}" if below is not None else "")
    return word


def _default(key: Mapping[str, Any]) -> str:
    """The default as YAML spells it; of a mapping only that it has defaults of its own."""
    made: object = {"object": {}, "array": []}.get(str(key.get("type")))  # by a factory, of which the schema does not tell
    value = key.get("default", made)
    if isinstance(value, dict):
        return "its own defaults" if value else "`{}`"
    spelled = yaml.safe_dump(value, default_flow_style=True, width=1000).removesuffix("...\n").strip()
    return f"`{spelled}`"


def _values(choice: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the values of a mapping with free names are."""
    values = choice.get("additionalProperties")
    return values if isinstance(values, dict) else {}


def _definition(choice: Mapping[str, Any]) -> str:
    return str(choice["$ref"]).rpartition("/")[2]


def _join_lines(text: str) -> str:
    return " ".join(text.split())


def _sentence(text: str) -> str:
    """Begin with a capital letter and end with a full stop."""
    return text and text[0].upper() + text[1:] + ("" if text.endswith(".") else ".")
