"""The posts of a new plan: who may send one, how much it may hold, and when."""

import http.client
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from websockets.sync.client import ClientConnection

from cmmlink.console.protocol import LARGEST_NOMINAL
from cmmlink.console.server import ConsoleServer
from cmmlink.console.station import Station

from .played import SECTION, Device, setup_of
from .test_server import TOKEN, answered, joined

ANSWERS = {"nominal": "section.yaml", "part": "blade", "tolerance": "0.05", "source": "COM3", "name": "new.yaml"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "plans").mkdir()
    return tmp_path / "plans"


@pytest.fixture
def server(folder: Path) -> Iterator[ConsoleServer]:
    def plans() -> dict[str, Path]:
        return {path.name: path for path in folder.glob("*.yaml")}

    server = ConsoleServer(Station(replace(setup_of({}, Device().connect), plans=plans, folder=folder)), "test", token=TOKEN)
    server.start()
    yield server
    server.stop()


def posted(server: ConsoleServer, path: str, told: dict[str, str], **headers: str) -> tuple[int, Any]:
    """Status and answer of a post; headers that are given replace those of a page of the station."""
    own = {"authorization": f"Bearer {TOKEN}", "origin": f"http://127.0.0.1:{server.port}"} | headers
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    connection.request("POST", f"{path}?{urlencode(told)}", SECTION.encode(), {name: value for name, value in own.items() if value})
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, json.loads(text) if answer.status == 200 else text


def number_of(page: ClientConnection) -> str:
    """The number that the station has given a page."""
    while (told := json.loads(page.recv(timeout=10)))["type"] != "hello":
        pass
    return str(told["page"])


def test_page_in_control_saves_a_plan_which_is_then_the_chosen_one(server: ConsoleServer, folder: Path) -> None:
    with joined(server) as page, joined(server) as watcher:
        control, watching = number_of(page), number_of(watcher)
        status, told = posted(server, "/nominal", {"nominal": "section.yaml"})
        assert (status, told["problem"], told["closed"]) == (200, "", True)
        assert answered(page, {"number": 1, "do": "acknowledge", "alarm": None})["ok"]
        assert posted(server, "/plan", ANSWERS | {"page": watching}) == (409, "another page is in control; this one watches")
        assert posted(server, "/plan", ANSWERS | {"page": "99"})[0] == 409
        assert posted(server, "/plan", ANSWERS)[0] == 409
        assert list(folder.iterdir()) == []
        status, told = posted(server, "/plan", ANSWERS | {"page": control})
        assert (status, told["name"], told["mistakes"]) == (200, "new.yaml", [])
    choice = server.station.state.choice
    assert choice is not None
    assert (choice.name, choice.problem, server.station.state.plans) == ("new.yaml", "", ("new.yaml",))


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"authorization": ""}, 401),
        ({"authorization": "Bearer guessed"}, 401),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"host": "evil.example"}, 400),
    ],
)
@pytest.mark.parametrize("path", ["/nominal", "/plan"])
def test_strangers_and_pages_of_other_origins_post_nothing(
    server: ConsoleServer, folder: Path, path: str, headers: dict[str, str], status: int
) -> None:
    with joined(server) as page:
        assert posted(server, path, ANSWERS | {"page": number_of(page)}, **headers)[0] == status
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("path", ["/nominal", "/plan"])
def test_a_huge_file_is_refused_before_it_is_read_whole(server: ConsoleServer, folder: Path, path: str) -> None:
    """Whether or not the head says how long it is."""
    pieces = (b"0" * (1 << 20) for _ in range((LARGEST_NOMINAL >> 20) + 1))
    with joined(server) as page:
        told = ANSWERS | {"page": number_of(page)}
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
        head = {"authorization": f"Bearer {TOKEN}", "transfer-encoding": "chunked"}
        connection.request("POST", f"{path}?{urlencode(told)}", pieces, head, encode_chunked=True)
        answer = connection.getresponse()
        assert (answer.status, answer.read()) == (413, b"the file is too large: expected at most 32 MB")
        connection.close()
        assert posted(server, "/nominal", {"nominal": "section.yaml"})[0] == 200, "the next one is taken"
    assert list(folder.iterdir()) == []


def test_station_takes_none_while_a_run_is_on(server: ConsoleServer, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with joined(server) as page:
        told = ANSWERS | {"page": number_of(page)}
        monkeypatch.setattr(Station, "running", property(lambda _: True))
        assert posted(server, "/plan", told) == (409, "a run is on; a plan can be made when it is over")
        assert posted(server, "/nominal", told)[0] == 409
    assert list(folder.iterdir()) == []
