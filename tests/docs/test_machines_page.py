"""docs/machines.md: every plan is one, macros do what is said of them, and points of devices are judged as those of a file."""

import io
import re
from collections.abc import Callable
from contextlib import AbstractContextManager, redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from numpy.typing import NDArray

from cmmlink.demo import plan_file, section_on_machine
from cmmlink.plan import Discretisation
from drivers import decoder
from simulators.dme_part import PathPart
from simulators.motion import Motion, walk
from tests.cmmlink.command import Ended, cmmlink
from tests.docs.macro_control import AlarmError, Control, programs_in
from tests.drivers.codecs.streams import decoded
from tests.integration.simulated import SEED, Simulated, simulated

Array = NDArray[np.float64]

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "machines.md").read_text(encoding="utf-8")
FINELY = "discretisation: {samples: 300}\nout: null\n"
RADIUS_MM, FORM_MM, LEAVES_MM = 1.0, 0.02, 0.002
MACRO, G800 = "A macro that prints a line a point", "A macro that prints G800 lines"
CAMERA, REGISTERS = "A camera or line scanner that sends lines of text", "A camera or line scanner that fills registers"
# What results by a file and by a device may differ in.
OF_ITS_WAY = {"run", "device", "simulated", "measured_at", "chain_sha256", "plan_sha256", "signature", "notes"}


def block(heading: str, language: str) -> str:
    """The first block in a language below a heading."""
    below = PAGE.split(f"# {heading}\n")[1]
    found = re.search(rf"^( *)```{language}\n(.*?)^ *```", below, re.DOTALL | re.MULTILINE)
    assert found is not None
    return re.sub(rf"^{found[1]}", "", found[2], flags=re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with all that plans of the page name."""
    nominal = plan_file().with_name("nominal.csv").read_bytes()
    (tmp_path / "nominal.csv").write_bytes(nominal)
    rows_mm = np.loadtxt(nominal.decode().splitlines(), delimiter=",", skiprows=2)
    np.savetxt(tmp_path / "upper.csv", rows_mm[: int(rows_mm[:, 0].argmin()) + 1], delimiter=",", fmt="%.6f")
    (tmp_path / "sample.txt").write_text(block(MACRO, "text") + "M30\n", encoding="ascii")
    (tmp_path / "blade.txt").write_text("1 2 3 0 0 0 0 0 0\n2 3 3 0 0 0 0 0 0\n", encoding="ascii")
    return tmp_path


@pytest.mark.parametrize("text", re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL))
def test_every_plan_of_the_page_is_checked(text: str, folder: Path) -> None:
    (folder / "plan.yaml").write_text(text + FINELY, encoding="utf-8")
    checked = cmmlink("check", folder / "plan.yaml")
    assert checked.code == 0, checked.err


def carried_out(folder: Path, text: str, device: str = "") -> Ended:
    """Run a plan, with a device of another place in its stead."""
    if device:
        text = re.sub(r"^device:.*?\n(?=\S)", f"device: {device}\n", text, count=1, flags=re.DOTALL | re.MULTILINE)
    (folder / "plan.yaml").write_text(text + FINELY, encoding="utf-8")
    return cmmlink("run", folder / "plan.yaml", "--json", "--records", folder / "records")


def judged(ended: Ended) -> dict[str, Any]:
    """What a run says of the part, and nothing of how its points came."""
    return {key: value for key, value in ended.json().items() if key not in OF_ITS_WAY}


def of_file(folder: Path, text: str, points_mm: Array, decimals: int) -> dict[str, Any]:
    """What the plan says of the same points out of a file."""
    np.savetxt(folder / "points.csv", points_mm, delimiter=",", fmt=f"%.{decimals}f")
    return judged(carried_out(folder, text, "{type: file, file: points.csv}"))


TOUCHED = ("--tip-radius-mm=1.0", f"--form-error-mm={FORM_MM}", "--unpaced")


@pytest.mark.parametrize(
    ("heading", "device", "address", "told"),
    [
        ("A coordinate measuring machine behind an I++ DME server", "dme", "127.0.0.1:1294", ()),
        ("A machine tool that touches the part on its table", "machine-tool", "127.0.0.1:9100", ()),
        (MACRO, "machine-tool-dprnt", "COM3", ("--translation-mm", "0", "-10", "0")),
    ],
)
def test_plans_of_the_page_find_the_part_that_is_simulated_without_a_path(
    heading: str, device: str, address: str, told: tuple[str, ...], folder: Path
) -> None:
    """The touched section at five points a second, as the page has it; the scanned one as fast as it goes."""
    text = block(heading, "yaml")
    with simulated(
        device, "127.0.0.1:0", folder, *TOUCHED, *told, path_mm=section_mm(), noise_mm=0.0, count=204, rate_hz=5.0, speed_mm_s=5.0
    ) as machine:
        ended = carried_out(folder, text.replace(address, machine.address))
    assert (ended.code, ended.json()["verdict"]) == (0, "conform"), ended.err
    assert f"simulate {device} --address 127.0.0.1:" in PAGE
    assert " ".join(told) in PAGE
    assert any("neither a checksum nor" in note or "no checksum" in note for note in ended.json()["notes"])


def sensor_of(device: str, folder: Path, path_mm: Array, motion: Motion, *options: str) -> tuple[AbstractContextManager[Simulated], Array]:
    """A simulated device that takes these points of the path as fast as they are fetched, and the points (n, 3)."""
    told = [f"--{name.replace('_mm', '-mm').replace('_', '-')}={getattr(motion, name):.17g}" for name in OF_THE_PART]
    told += [] if motion.closed else ["--open", f"--start-mm={motion.start_mm}"]
    device_itself = simulated(
        device,
        "127.0.0.1:0",
        folder,
        "--unpaced",
        *told,
        *options,
        path_mm=path_mm,
        noise_mm=motion.noise_mm,
        count=motion.count or 1,
        rate_hz=motion.rate_hz,
        speed_mm_s=motion.speed_mm_s,
    )
    return device_itself, walk(path_mm, motion).points_mm


OF_THE_PART = ("form_error_mm", "defect_mm", "defect_station_mm", "resolution_mm")


@pytest.mark.parametrize(("defect_mm", "code"), [(0.0, 0), (0.15, 1)])
def test_lines_of_a_camera_are_judged_as_the_same_points_in_a_file(defect_mm: float, code: int, folder: Path) -> None:
    text, line = block(CAMERA, "yaml"), re.findall(r'--line "(.*?)"', PAGE)[0]
    motion = Motion(510.0, 1000.0, 400, True, FORM_MM, 0.001, defect_mm, 60.0, resolution_mm=0.001, seed=SEED)
    device, sent_mm = sensor_of("machine-tool-dprnt", folder, section_mm(), motion, f"--line={line}")
    with device as camera:
        ended = carried_out(folder, text.replace("127.0.0.1:8500", camera.address))
    assert ended.code == code, ended.err
    assert (ended.json()["received"], ended.json()["judged"]) == (400, 400)
    assert judged(ended) == of_file(folder, text, sent_mm, 4)


def test_a_camera_that_does_not_find_a_point_proves_nothing(folder: Path) -> None:
    text, line = block(CAMERA, "yaml"), "{number};{x:.4f};{y:.4f}"
    rows = [line.format(number=k + 1, x=x, y=y) for k, (x, y) in enumerate(section_mm()[::5].tolist())]
    kept_out = re.findall(r"`(\(\?P<x>\(\?!.*?)`", PAGE)[0]
    for missing in ("201;;", None, "FAIL", "201;-9999;-9999"):
        shown = [row if k != 200 else missing for k, row in enumerate(rows)]
        (folder / "lines.txt").write_text("\r\n".join(["READY", *filter(None, shown), "END", ""]), encoding="ascii")
        device = re.search(r"^device:\n(.*?)(?=^\S)", text, re.DOTALL | re.MULTILINE)
        assert device is not None
        of_a_file = device[1].replace('address: "127.0.0.1:8500"', "file: lines.txt\n  existing: true")
        ended = carried_out(folder, text.replace(device[1], of_a_file.replace("(?P<x>[-+.0-9]*)", kept_out)))
        assert (ended.code, ended.json()["verdict"]) == (3, "uncertain"), ended.err


def test_registers_of_a_line_scanner_are_judged_as_the_same_points_in_a_file(folder: Path) -> None:
    text, path_mm = block(REGISTERS, "yaml"), np.loadtxt(folder / "upper.csv", delimiter=",")
    length_mm = float(np.hypot(*np.diff(path_mm, axis=0).T).sum())
    motion = Motion(2.0 * (length_mm - 0.4), 1000.0, 500, False, FORM_MM, 0.001, start_mm=0.2, seed=SEED)
    device, sent_mm = sensor_of("gocator", folder, path_mm, motion)
    with device as scanner:
        ended = carried_out(folder, text.replace("127.0.0.1:5020", scanner.address))
    assert (ended.code, ended.json()["judged"]) == (0, 500), ended.err
    assert judged(ended) == of_file(folder, text, sent_mm[:, [0, 2, 1]], 3)


@cache
def course() -> str:
    """The lines G65 that the page's Python makes of the nominal."""
    code = block(MACRO, "python").replace('"cmmlink/demo/nominal.csv"', repr(str(plan_file().with_name("nominal.csv"))))
    found: dict[str, Any] = {}
    with patch("cmmlink.scripting.Discretisation", lambda: Discretisation(samples=300)), redirect_stdout(io.StringIO()):
        exec(code, found)
    return "\n".join(found["lines"])


@cache
def section_mm() -> Array:
    return section_on_machine()[::10]


@cache
def part() -> PathPart:
    path_mm = section_mm() - np.array([0.0, 10.0])
    return PathPart(path_mm, Motion(1.0, 1.0, form_error_mm=FORM_MM, tip_radius_mm=RADIUS_MM))


def met(start_mm: Array, target_mm: Array) -> Array | None:
    """Where the ball meets the part on its way; it may touch it where it begins, and leaves it then."""
    way = start_mm - target_mm
    far = float(np.linalg.norm(way)) - LEAVES_MM
    return part().touch(target_mm, way / np.linalg.norm(way), far, 0.0) if far > 0 else None


@cache
def probed(change: Callable[[str], str] = str, sign_places: int = 0, most: int = 1000) -> Control:
    """The control when the page's programs are through, with so many points of the course at most."""
    text = change(block(MACRO, "nc"))
    where = re.search(r"^\(HERE COME THE POINTS, LIKE (.*)\)$", text, re.MULTILINE)
    assert where is not None
    programs = programs_in(text.replace(where[0], "\n".join(course().splitlines()[:most])))
    assert where[1] in course().splitlines()
    control = Control(programs, met, np.array([110.0, 0.0, 0.0]), sign_places=sign_places)
    control.run(7000)
    return control


def test_the_macro_prints_the_points_of_the_part(folder: Path) -> None:
    printed = probed().printed
    assert printed[:2] == block(MACRO, "text").splitlines()
    text, count = block(MACRO, "yaml"), len(course().splitlines())
    assert count == 205
    kept = re.findall(r"format: (\{.*\})", text)[0]
    (folder / "printed.txt").write_text("\r".join([*printed, ""]), encoding="ascii")
    ended = carried_out(folder, text, f"{{type: lines, file: printed.txt, existing: true, unit: mm, format: {kept}}}")
    assert (ended.code, ended.json()["judged"], ended.json()["lost"]) == (0, count, 0), ended.err
    assert 0.9 * FORM_MM < max(ended.json()["max_deviation_mm"], -ended.json()["min_deviation_mm"]) < FORM_MM + 0.001
    rows = [re.findall(r"[-.0-9]+", line)[1:] for line in printed[:-1]]
    assert judged(ended) == of_file(folder, text, np.array(rows, dtype=np.float64), 4)


def test_the_macro_in_the_language_of_inspection_is_read_by_name() -> None:
    nominal, measured = block(G800, "nc").splitlines()

    def change(text: str) -> str:
        text = text.replace("DPRNT[M30]", "DPRNT[END]").replace("POPEN", "POPEN\nDPRNT[START]")
        text = text.replace("G31 X#32 Y#33 F50", f"{nominal}\nG31 X#32 Y#33 F50")
        return text.replace("DPRNT[N#100[40]*X#5061[44]*Y#5062[44]*Z#5063[44]]", measured)

    printed = probed(change, sign_places=1, most=40).printed
    book = decoded(decoder("g800", unit="mm", tip_radius_mm=RADIUS_MM), "\r".join([*printed, ""]).encode("ascii"))
    own = [[float(number) for number in re.findall(r"[-.0-9]+", line)[1:]] for line in probed().printed[:40]]
    np.testing.assert_allclose(np.array(book.points_mm), own, atol=1e-9)
    assert not book.counts


def test_where_the_macro_meets_nothing_it_prints_nothing_and_a_touch_on_the_way_ends_it() -> None:
    short = probed(lambda text: text.replace("#502=1.0", "#502=-0.001"), most=60)  # the search ends before a surface that lies too deep
    numbers = [int(re.findall(r"[0-9]+", line)[0]) for line in short.printed[:-1]]
    assert 10 < len(numbers) < 50
    assert numbers == sorted(set(numbers))
    with pytest.raises(AlarmError):
        probed(lambda text: text.replace("#501=2.0", "#501=-0.5"))


def test_a_log_of_probing_is_read(folder: Path) -> None:
    points = [re.findall(r"[-.0-9]+", line)[1:] for line in probed().printed[:-1]]
    rows = [" ".join([*point, *6 * ["0.000000"]]) for point in points]
    (folder / "blade.txt").write_text("\n".join([*rows, ""]), encoding="ascii")
    ended = carried_out(folder, block("A log of probing", "yaml"))
    assert (ended.code, ended.json()["judged"]) == (0, len(points)), ended.err
