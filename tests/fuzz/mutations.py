"""Sound inputs made unsound, by what they are made of: bytes, lines, numbers, words, and the values of a tree."""

import re
import struct
from collections.abc import Callable
from random import Random
from typing import Any

import yaml

NUMBERS = (
    *("0", "-0", "1", "-1", "1e308", "-1e308", "1e-308", "1e309", "nan", "inf", "-inf", "0.1", "1e15", "1e16", "9" * 400, "1" + "0" * 5000),
    *(
        "0x10",
        "1_000",
        "1,5",
        "1.5.2",
        "\u0661",
        "²",
        "1e",
        ".",
        "-",
        "+5",
        "1e5.5",
        "65536",
        "4294967296",
        "9223372036854775808",
        "1d3",
        "TRUE",
    ),
)
WORDS = (
    *(
        "",
        " ",
        "\t",
        "\x00",
        "\r",
        "\n",
        "\r\n",
        "\x0b",
        "\x1a",
        "\ufeff",
        "\u2028",
        "é",
        "\U0001f600",
        "\udc80",
        "#",
        "//",
        "%",
        ";",
        ",",
        ";;",
        '"',
        "'",
        "''",
    ),
    *(
        "x",
        "y",
        "z",
        "mm",
        "inch",
        "NaN",
        "null",
        "~",
        "true",
        "[",
        "]",
        "{",
        "}",
        "[[",
        ": ",
        "- ",
        "&a",
        "*a",
        "!!python/object:os.system",
        "|",
    ),
    *(
        "solid",
        "facet normal",
        "vertex",
        "endloop",
        "endfacet",
        "endsolid",
        "f 1 2 3",
        "f -1 -2 -3",
        "v 1 2 3",
        "o",
        "element face 3",
        "end_header",
    ),
    *("../../evil", "/dev/zero", "/dev/stdin", "con", "a$_$", "[/]", "{part}", "%s", "<script>", "$(id)"),
)
_NUMBER = re.compile(rb"[-+]?[0-9]+(?:[.,][0-9]+)?(?:[eE][-+]?[0-9]+)?")
LARGEST = 500_000  # bytes of an input
Mutation = Callable[[bytes, Random], bytes]


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


def flip(data: bytes, rng: Random) -> bytes:
    """Turn bits over."""
    changed = bytearray(data)
    for _ in range(rng.choice([1, 1, 3, 20]) if changed else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def splice(data: bytes, rng: Random) -> bytes:
    """Leave out, repeat or move a piece."""
    if not data:
        return rng.randbytes(20)
    first = rng.randrange(len(data))
    last = min(len(data), first + rng.choice([1, 2, 8, 100, 1000]))
    piece, rest = data[first:last], data[:first] + data[last:]
    at = rng.randint(0, len(rest))
    return rng.choice([rest, rest[:at] + piece + rest[at:], data[:last] + rng.choice([1, 2, 50]) * piece + data[last:], data[:first]])


def insert(data: bytes, rng: Random) -> bytes:
    """Put bytes in: random ones, zeros, and words that mean something to a reader."""
    at = rng.randint(0, len(data))
    made = rng.choice([rng.randbytes(rng.choice([1, 4, 40])), bytes(rng.choice([1, 64])), _encoded(rng.choice(WORDS + NUMBERS))])
    return data[:at] + made + data[at:]


def change_number(data: bytes, rng: Random) -> bytes:
    """Put another number in the place of one."""
    found = list(_NUMBER.finditer(data[:200_000]))
    if not found:
        return insert(data, rng)
    for place in sorted(rng.sample(found, min(len(found), rng.choice([1, 1, 2, 10]))), key=lambda one: -one.start()):
        data = data[: place.start()] + _encoded(rng.choice(NUMBERS)) + data[place.end() :]
    return data


def change_lines(data: bytes, rng: Random) -> bytes:
    """Leave out, repeat, swap, join and lengthen lines, and end them otherwise."""
    end = rng.choice([b"\n", b"\n", b"\r\n", b"\r", b"\n\n", b"\x0c", b" "])
    lines = data.splitlines()
    for _ in range(rng.choice([1, 2, 5]) if lines else 0):
        at = rng.randrange(len(lines))
        line = lines[at]
        lines[at : at + 1] = rng.choice(
            [
                [],
                [line, line],
                [line + line],
                [line[: len(line) // 2]],
                [b"#" + line],
                [b" " * 200 + line],
                [line[:1000] * 300],
                30 * [line[:1000]],
                [b"", line],
            ]
        )
        if not lines:
            break
    if rng.random() < 0.1:
        rng.shuffle(lines)
    return end.join(lines)


def change_code(data: bytes, rng: Random) -> bytes:
    """Write a text in another way: UTF-16, Latin-1, with a mark, with other separators."""
    text = data.decode("utf-8", "replace")
    way = rng.randrange(8)
    if way < 4:
        return (b"\xef\xbb\xbf" if way == 3 else b"") + text.encode(("utf-16", "utf-16-be", "latin-1", "utf-8")[way], "replace")
    old, new = ((b",", b";"), (b" ", b"\t"), (b"\n", b"\0"), (b".", b","))[way - 4]
    return data.replace(old, new)


def change_tree(data: bytes, rng: Random) -> bytes:
    """Read YAML, put another value in the place of one, leave one out or nest it, and write it again."""
    try:
        return _changed_tree(data, rng)
    except (yaml.YAMLError, ValueError, RecursionError):  # nested deeper than PyYAML can follow, as some that are changed again are
        return change_lines(data, rng)


def _changed_tree(data: bytes, rng: Random) -> bytes:
    tree = yaml.safe_load(data)
    for _ in range(rng.choice([1, 1, 2, 4])):
        _change_value(tree, rng)
    return yaml.safe_dump(tree, default_flow_style=rng.random() < 0.3, allow_unicode=True, width=10_000).encode("utf-8", "surrogateescape")


def _change_value(tree: Any, rng: Random) -> None:
    places: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        keys = list(node) if isinstance(node, dict) else list(range(len(node))) if isinstance(node, list) else []
        places += [(node, key) for key in keys]
        waiting += [node[key] for key in keys]
    if not places:
        return
    node, key = rng.choice(places)
    number = rng.choice([0, -1, 1, 1e308, float("nan"), float("inf"), 2**63, 2**64, 1e-300, 65536, 0.5])
    values = [number, rng.choice(WORDS[:20]), rng.choice(NUMBERS), None, True, [], {}, [node[key]], {"x": node[key]}, 40 * [number], node]
    chosen = rng.choice(values)
    if chosen is node:
        node.update({rng.choice(["at", "x", "file", "type"]): number}) if isinstance(node, dict) else node.append(number)
    elif rng.random() < 0.2:
        del node[key]
    else:
        node[key] = chosen


def change_npy(data: bytes, rng: Random) -> bytes:
    """Say another kind, order or shape in the header of an npy file, or change its words."""
    magic, size = data[:8], int.from_bytes(data[8:10], "little")
    header = data[10 : 10 + size].decode("latin-1")
    changes = (
        (
            "(360, 2)",
            rng.choice(["(2, 360)", "(0, 2)", "(360,)", "(10**9, 2)", "(9223372036854775807, 2)", "(-1, 2)", "()", "(360, 2, 1)"]),
        ),
        ("<f8", rng.choice(["<f4", ">f8", "<i8", "|O", "|V16", "<c16", "|b1", "<U4", "<f2", "|S8", "<M8[s]", "[('x','<f8'),('y','<f8')]"])),
        ("False", rng.choice(["True", "0", "None", "[" * 100])),
        ("descr", rng.choice(["describe", "'" * 3])),
    )
    for word, other in rng.sample(changes, rng.choice([1, 2])):
        header = header.replace(word, other)
    return magic + len(header).to_bytes(2, "little") + header.encode("latin-1") + data[10 + size :]


def change_stl(data: bytes, rng: Random) -> bytes:
    """Say another number of triangles, or put a number that is none into a corner."""
    if len(data) < 200:
        return flip(data, rng)
    at = 84 + 50 * rng.randrange((len(data) - 84) // 50) + rng.randrange(0, 48, 4)
    value = rng.choice([float("nan"), float("inf"), 1e38, -1e38, 1e-45, 0.0, 1e20])
    count = rng.choice([0, 1, 2**32 - 1, 2**31, (len(data) - 84) // 50 + 1, 10**6])
    return rng.choice(
        [data[:80] + struct.pack("<I", count) + data[84:], data[:at] + struct.pack("<f", value) + data[at + 4 :], b"solid " + data[6:]]
    )


ANY: tuple[Mutation, ...] = (flip, splice, insert)
TEXT: tuple[Mutation, ...] = (*ANY, change_number, change_number, change_lines, change_code)
TREE: tuple[Mutation, ...] = (*TEXT, change_tree, change_tree, change_tree, change_tree)


def mutated(seed: bytes, mutations: tuple[Mutation, ...], rng: Random) -> bytes:
    """A sound input after one to four mutations; now and then nothing sound is left."""
    data = seed if rng.random() < 0.98 else rng.randbytes(rng.choice([0, 1, 100, 3000]))
    for _ in range(rng.choice([1, 1, 2, 4])):
        data = rng.choice(mutations)(data, rng)[:LARGEST]
    return data
