"""The page's copy of the protocol is what the program gives, and what is sent has the declared keys."""

import json
import re
from dataclasses import fields
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import cmmlink.console
from cmmlink.console.declarations import constants_js, declarations_ts
from cmmlink.console.protocol import HEADER, HEADER_BYTES, Command, Control, Message, json_of
from cmmlink.run_state import RunState

STATIC = Path(cmmlink.console.__file__).with_name("static")


@pytest.mark.parametrize(("name", "given"), [("protocol.js", constants_js()), ("protocol.d.ts", declarations_ts())])
def test_files_of_the_page_are_those_of_the_protocol(name: str, given: str) -> None:
    assert (STATIC / name).read_text(encoding="utf-8") == given, "write them anew: python -m cmmlink.console.declarations"


def test_header_is_as_long_as_it_says() -> None:
    assert np.dtype(list(HEADER)).itemsize == HEADER_BYTES


def test_every_message_and_command_is_told_apart_by_one_word() -> None:
    for union, key in ((Message, "type"), (Command, "do")):
        words = [word for record in get_args(union) for word in get_args(record.__annotations__[key])]
        assert len(words) == len(set(words))


def test_declaration_names_every_key_of_a_run() -> None:
    body = re.search(r"export interface RunState \{(.*?)\n\}", declarations_ts(), re.DOTALL)
    assert body is not None
    assert re.findall(r"readonly (\w+):", body[1]) == [field.name for field in fields(RunState)]
    assert len(fields(RunState)) == 44


def test_message_is_sent_with_its_type_and_keys() -> None:
    assert json.loads(json_of(Control(True, True, 2))) == {"type": "control", "controls": True, "taken": True, "pages": 2}
