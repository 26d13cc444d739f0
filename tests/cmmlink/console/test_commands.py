import json
from typing import Any

import pytest

from cmmlink.console.commands import action_of, receive
from cmmlink.console.protocol import Acknowledge, Choose, Command, Enter, OfRun, OpenSection, Plain
from cmmlink.console.refused import Refused
from cmmlink.console.station import Station

from .played import Device, setup_of


@pytest.mark.parametrize(
    ("document", "command"),
    [
        ({"do": "choose", "plan": "blade.yaml"}, Choose("blade.yaml")),
        ({"do": "enter", "operator": "Ada"}, Enter(operator="Ada")),
        ({"do": "acknowledge"}, Acknowledge(None)),
        ({"do": "acknowledge", "alarm": 3}, Acknowledge(3)),
        ({"do": "open", "run": "last"}, OfRun("last", "open")),
        ({"do": "replay", "run": "last"}, OfRun("last", "replay")),
        ({"do": "section", "section": 2}, OpenSection(2)),
        ({"do": "take control", "more": "is passed over"}, Plain("take control")),
    ],
)
def test_command_is_read_with_what_it_needs(document: dict[str, Any], command: Command) -> None:
    received = receive(json.dumps({"number": 4, **document}))
    assert received.number == 4
    assert received.command() == command


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("no json", "there is no command 'None'"),
        ("[1, 2]", "there is no command"),
        ('{"do": "format"}', "there is no command 'format'"),
        ('{"do": "choose"}', "needs a text 'plan'"),
        ('{"do": "choose", "plan": null}', "needs a text 'plan'"),
        ('{"do": "enter", "serial_number": 7}', "needs a text 'serial_number'"),
        ('{"do": "acknowledge", "alarm": "all"}', "needs a whole number 'alarm'"),
        ('{"do": "acknowledge", "alarm": true}', "needs a whole number 'alarm'"),
        ('{"do": "section", "section": 1.5}', "needs a whole number 'section'"),
        ('{"do": "section"}', "needs a whole number 'section'"),
    ],
)
def test_command_that_makes_no_sense_is_refused_in_words(text: str, says: str) -> None:
    with pytest.raises(Refused, match=says):
        receive(text).command()


def test_every_command_of_the_one_in_control_asks_the_station_and_no_other_does() -> None:
    station = Station(setup_of({}, Device().connect))
    asks = {
        "choose": "there is no plan",
        "enter": None,
        "start": "choose a plan first",
        "end": "nothing is being measured",
        "abort": "nothing is being measured",
        "test": "choose a plan first",
        "acknowledge": None,
        "replay": "keeps no records",
        "import": "there is no CT plan",
    }
    for do, refusal in asks.items():
        action = action_of(receive(json.dumps({"do": do, "plan": "x", "run": "x"})).command(), station)
        assert action is not None
        if refusal is None:
            assert action()
        else:
            with pytest.raises(Refused, match=refusal):
                action()
    for do in ("take control", "live", "devices", "open", "section"):
        assert action_of(receive(json.dumps({"do": do, "run": "x", "section": 0})).command(), station) is None
