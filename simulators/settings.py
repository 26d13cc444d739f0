"""What a simulated device is told, from Python or from a command line, and how its parent process hears of it."""

import argparse
import os
import sys
import threading
import time
from _thread import interrupt_main
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from simulators.faults import CATALOGUE, Fault
from simulators.motion import Motion, read_path

_ENDS_WITHIN_S = 0.5
LAST_REQUEST = 9_999_999  # a variable of a control holds seven digits exactly


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """What a simulated device is told.

    address    `pty` or `host:port`; port 0 takes any free one
    path_mm    (k, 2) or (k, 3) points of the path on the part
    answer     the file in which a machine tool finds the verdict that it asks for
    request    the number by which it asks; None: another one each time, where it asks
    answer_s   how long it waits for the answer
    bound      end when standard input does
    paced      take points when they are due by `motion.rate_hz`; otherwise as fast as the client fetches them
    line       what a machine prints of a point that prints lines of the user's own, like {number};{x:.4f};{y:.4f}; nothing: its own
    """

    address: str
    path_mm: NDArray[np.float64]
    motion: Motion
    faults: tuple[Fault, ...] = ()
    paced: bool = True
    bound: bool = False
    line: str = ""
    answer: Path | None = None
    request: int | None = None
    answer_s: float = 60.0


Announce = Callable[[str], None]
Serve = Callable[[SimulatorSettings, Announce], None]


def settings_from(
    arguments: Sequence[str], program: str | None = None, default_path: Callable[[], NDArray[np.float64]] | None = None
) -> SimulatorSettings:
    """Read the settings from command-line arguments.

    program      : how the caller is called, for the help
    default_path : gives the path where the arguments name none; without it they have to
    """
    parser = _parser(program, needs_path=default_path is None)
    given = {name: value for name, value in vars(parser.parse_args(arguments)).items() if value is not None}
    if "translation_mm" in given:
        given["translation_mm"] = tuple(given["translation_mm"])
    try:
        motion = Motion(**{field.name: given[field.name] for field in fields(Motion) if field.name in given})
        faults = tuple(Fault.parse(text) for text in given["fault"])
        path_mm = default_path() if default_path is not None and "path" not in given else read_path(given["path"])
        asked = {name: given[name] for name in ("line", "answer", "request", "answer_s") if name in given}
        return SimulatorSettings(given["address"], path_mm, motion, faults, not given["unpaced"], given["until_stdin_ends"], **asked)
    except FileNotFoundError:
        parser.error(f"{given['path']}: no such file")
    except (ValueError, OSError) as error:
        parser.error(str(error))


_ADDRESS = "pty, or host:port (port 0: any free one); a machine tool takes to:host:port and file:PATH as well"

_LINE = "the line that machine-tool-dprnt prints of a point, like '{number};{x:.4f};{y:.4f}'; END follows the last one [its own]"


class _OneLine(argparse.ArgumentParser):
    """A parser whose errors are one message, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; `{self.prog} --help` shows what is allowed\n")


def _parser(program: str | None, *, needs_path: bool) -> argparse.ArgumentParser:
    faults = "\n".join(f"  {name:18}{kind.meaning} [{kind.default:g}]" for name, kind in CATALOGUE.items())
    parser = _OneLine(
        prog=program,
        usage=f"%(prog)s --address A {'--path POINTS' if needs_path else '[--path POINTS]'} [OPTIONS]",
        description="A simulated device that streams one scan; its first line of output is the address it serves.",
        epilog=f"faults, from point number POINT on (up to before STOP), with the value and its default:\n{faults}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--address", required=True, metavar="A", help=_ADDRESS)
    usual = "" if needs_path else " [the section of the demonstration]"
    parser.add_argument("--path", required=needs_path, type=Path, metavar="POINTS", help=f"points of the path on the part, mm{usual}")
    parser.add_argument("--fault", action="append", default=[], metavar="NAME[:VALUE][@POINT[-STOP]]", help="may be given several times")
    parser.add_argument("--line", default="", metavar="TEXT", help=_LINE)
    parser.add_argument("--until-stdin-ends", action="store_true", help="end when standard input does: with whoever started it")
    parser.add_argument("--unpaced", action="store_true", help="as fast as the client takes the points")
    parser.add_argument("--rate", dest="rate_hz", type=float, default=1000.0, metavar="HZ", help="points per second [%(default)g]")
    parser.add_argument("--speed", dest="speed_mm_s", type=float, default=50.0, metavar="MM_S", help="mm per second [%(default)g]")
    parser.add_argument("--count", type=int, metavar="N", help="points to send [once along the path]")
    parser.add_argument("--open", dest="closed", action="store_false", help="the path is open")
    parser.add_argument("--backward", action="store_true", help="against the order of the path")
    parser.add_argument("--seed", type=int, metavar="N", help="of form error, noise and faults [0]")
    parser.add_argument("--answer", type=Path, metavar="FILE", help="a machine tool asks for the verdict, and waits for it in this file")
    parser.add_argument("--request", type=_request_number, metavar="N", help="the number by which it asks [another one each time]")
    parser.add_argument("--answer-within", dest="answer_s", type=float, metavar="S", help="how long it waits for the answer [60]")
    for name, meaning in _MILLIMETRES.items():
        parser.add_argument(f"--{name}-mm", type=float, metavar="MM", help=meaning)
    parser.add_argument("--rotation-deg", type=float, metavar="DEG", help="how the part is turned on the machine")
    parser.add_argument("--translation-mm", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where the part lies on the machine")
    return parser


def _request_number(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= len(str(LAST_REQUEST)) and int(text) >= 1):
        raise argparse.ArgumentTypeError(f"expected a whole number from 1 to {LAST_REQUEST}, got {text!r}")
    return int(text)


_MILLIMETRES: Mapping[str, str] = MappingProxyType(
    {
        "form-error": "largest deviation of the smooth form error",
        "noise": "standard deviation of the noise",
        "tip-radius": "send centres of a ball of this radius",
        "defect": "height of a local defect",
        "defect-station": "where along the path the defect is",
        "start": "where along the path the scan begins",
        "resolution": "step of the scales by which the machine tells its positions",
    }
)


def refuse_answer(settings: SimulatorSettings) -> None:
    """Raise ValueError where a device that asks for no verdict is to do so."""
    if settings.answer is not None or settings.request is not None:
        raise ValueError("--answer and --request are for machine tools, which ask for a verdict")


def end_with_stdin() -> None:
    """Interrupt this program once nobody holds the other end of standard input any more; end it at once where that takes long."""

    def wait_for_end() -> None:
        while os.read(0, 4096):
            pass
        interrupt_main()
        time.sleep(_ENDS_WITHIN_S)
        os._exit(130)

    threading.Thread(target=wait_for_end, name="parent", daemon=True).start()


def say(text: str) -> None:
    """Write one line for the parent process to read at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
