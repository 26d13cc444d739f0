"""Plans: what a short one means, and that every mistake is named with file, line, key, value and what is allowed."""

from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from cmmlink.errors import PlanError
from cmmlink.plan.own_maps import map_of
from cmmlink.plan.scan import Plan, load_plan
from cmmlink.plan.scan_devices import FileDevice, ModbusDevice, SerialDevice
from cmmlink.plan.yaml_model import read_model
from cmmlink.record.run_inputs import RunInputs
from inspection import ToleranceZone

SHORT = """\
part: {name: blade, serial_number: 0012}
nominal: {file: blade.dat, scale: 1e2}
tolerance:
  lower_mm: -0.05
  upper_mm: 0.05
device: {type: serial, address: COM3}
"""

FULL = """\
part: {name: "blade, left", serial_number: null}
operator: A. Operator
nominal: {file: /nominals/blade.yaml, scale: 1, closed: true, material: right}
tolerance: {lower_mm: -0.1, upper_mm: 0.3, uncertainty_mm: 0.01}
device: {type: file, file: points.csv, scale: 25.4}
probe: {tip_radius_mm: 1.5}
section: {origin_mm: [1, 2, 3], x_axis: [0, 1, 0], normal: [0, 0, -2], off_plane_max_mm: 0.5}
registration: {datum: {rotation_deg: 30, translation_mm: [1, -2]}, method: veaw, coverage_min: 0.5}
discretisation: {samples: 2000, pole_angle_min_deg: 179, step_min: 1e-5}
buffer_points: 1000
out: results
records: records
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "plan.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_short_plan_gets_the_documented_defaults(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, SHORT))
    assert (plan.part.name, plan.part.serial_number, plan.operator) == ("blade", "0012", None)
    assert (plan.nominal.file, plan.nominal.scale) == (tmp_path / "blade.dat", 100.0)
    assert (plan.nominal.closed, plan.nominal.material) == (None, None)
    assert plan.zone == ToleranceZone(-0.05, 0.05, 0.0)
    assert plan.device == SerialDevice(type="serial", address="COM3", baud_rate=115200, silence_s=5.0)
    assert plan.probe.tip_radius_mm == 0
    assert (plan.section.origin_mm, plan.section.x_axis, plan.section.normal) == ((0, 0, 0), (1, 0, 0), (0, 0, 1))
    assert plan.section.off_plane_max_mm is None
    assert (plan.registration.fit, plan.registration.method, plan.registration.datum) == ("best-fit", "exact", None)
    assert plan.registration.coverage_min == 0.95
    assert (plan.discretisation.samples, plan.discretisation.pole_angle_min_deg, plan.discretisation.step_min) == (10_000, 178.0, 1e-4)
    assert (plan.buffer_points, plan.out.folder, plan.records.folder) == (500_000, tmp_path / "results/{part}/{serial}_{run}", None)


def test_full_plan_says_what_it_says(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, FULL))
    assert (plan.part.name, plan.operator) == ("blade, left", "A. Operator")
    assert (plan.nominal.file, plan.nominal.closed, plan.nominal.material) == (Path("/nominals/blade.yaml"), True, "right")
    assert plan.zone == ToleranceZone(-0.1, 0.3, 0.01)
    assert plan.device == FileDevice(type="file", file=tmp_path / "points.csv", scale=25.4)
    assert plan.section.off_plane_max_mm == 0.5
    assert plan.registration.datum is not None
    assert (plan.registration.datum.rotation_deg, plan.registration.datum.translation_mm) == (30, (1, -2))
    assert plan.registration.fit == "none"
    assert (plan.out.folder, plan.records.folder) == (tmp_path / "results", tmp_path / "records")


@pytest.mark.parametrize("text", [SHORT, FULL, SHORT.replace("COM3", '"null"').replace("blade,", "'~',")])
def test_effective_plan_means_the_same_from_any_folder(tmp_path: Path, text: str) -> None:
    plan = load_plan(written(tmp_path, text))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    assert load_plan(written(elsewhere, plan.effective_yaml())) == plan


def test_plan_cannot_be_changed_but_for_an_address_in_a_copy(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, SHORT))
    with pytest.raises(ValidationError, match="frozen"):
        plan.buffer_points = 1
    moved = plan.with_address("127.0.0.1:9")
    assert isinstance(moved.device, SerialDevice)
    assert moved.device.address == "127.0.0.1:9"
    assert moved.with_address("COM3") == plan


MISTAKES = {
    "misspelt key": (
        SHORT.replace("upper_mm", "uper_mm"),
        "line 5: tolerance.uper_mm is not a known key; did you mean upper_mm? Allowed: lower_mm,",
    ),
    "unknown section": (
        SHORT + "colour: red\n",
        "line 7: colour is not a known key; Allowed: rule, weights, gap_max_mm, end_allowance_mm, allow, characteristics, tolerance,",
    ),
    "missing key": (SHORT.replace("  upper_mm: 0.05\n", ""), "line 3: tolerance.upper_mm is missing: expected the upper limit"),
    "missing section": (
        SHORT.replace("nominal:", "operator: x #"),
        "line 1: nominal is missing: expected a mapping with the nominal's file",
    ),
    "limits crossed": (
        SHORT.replace("upper_mm: 0.05", "upper_mm: -0.06"),
        "line 5: tolerance.upper_mm is '-0.06'; expected a number above the lower limit, -0.05",
    ),
    "limits equal": (SHORT.replace("upper_mm: 0.05", "upper_mm: -0.05"), "line 5: tolerance.upper_mm is '-0.05'; expected a number above"),
    "uncertainty": (
        SHORT.replace("0.05\ndev", "0.05\n  uncertainty_mm: 0.05\ndev"),
        "line 6: tolerance.uncertainty_mm is '0.05'; expected zero or more, and less than",
    ),
    "word for number": (SHORT.replace("-0.05", "tight"), "line 4: tolerance.lower_mm is 'tight'; expected a number"),
    "decimal comma": (SHORT.replace("-0.05", "-0,05"), "line 4: tolerance.lower_mm is '-0,05'; expected a number, with a decimal point"),
    "empty value": (SHORT.replace("-0.05", ""), "line 4: tolerance.lower_mm is empty; expected a number"),
    "infinite": (SHORT.replace("1e2", "inf"), "line 2: nominal.scale is 'inf'; expected a finite number"),
    "zero scale": (SHORT.replace("1e2", "0"), "line 2: nominal.scale is '0'; expected a number greater than 0"),
    "device type": (
        SHORT.replace("serial, ", "seriel, "),
        "line 6: device.type is 'seriel'; did you mean serial? Allowed: serial, modbus, dme, lines, file",
    ),
    "no device type": (SHORT.replace("type: serial, ", ""), "line 6: device.type is missing; Allowed: serial, modbus, dme, lines, file"),
    "device key": (
        SHORT.replace("address", "adress"),
        "line 6: device.adress is not a known key; did you mean address? Allowed: type, address, baud_rate, silence_s",
    ),
    "outliers without a fit": (
        SHORT + "registration:\n  fit: none\n  reject_outliers: true\n",
        "line 9: registration.reject_outliers is 'true'; expected false where fit is none: outliers are found by fitting the other points",
    ),
    "baud rate": (SHORT.replace("COM3", "COM3, baud_rate: 9.6k"), "line 6: device.baud_rate is '9.6k'; expected a whole number"),
    "device no mapping": (
        SHORT.replace("{type: serial, address: COM3}", "COM3"),
        "line 6: device is 'COM3'; expected a mapping with type, address",
    ),
    "choice": (
        SHORT + "registration: {fit: bestfit}\n",
        "line 7: registration.fit is 'bestfit'; expected 'best-fit', 'minimum-zone' or 'none'",
    ),
    "yes for true": (SHORT.replace("1e2", "1, closed: maybe"), "line 2: nominal.closed is 'maybe'; expected true or false"),
    "datum and fit": (
        SHORT + "registration:\n  fit: best-fit\n  datum: {rotation_deg: 3}\n",
        "line 8: registration.fit is 'best-fit'; expected none, or no fit",
    ),
    "short vector": (SHORT + "section: {normal: [0, 1]}\n", "line 7: section.normal[2] is missing"),
    "zero vector": (
        SHORT + "section: {normal: [0, 0, 0]}\n",
        "line 7: section.normal is a list of 3; expected a direction other than [0, 0, 0]",
    ),
    "parallel": (
        SHORT + "section: {x_axis: [0, 0, 2]}\n",
        "line 7: section.x_axis is a list of 3; expected a direction other than that of the normal",
    ),
    "parallel to the default": (
        SHORT + "section: {normal: [1, 0, 0]}\n",
        "line 7: section.x_axis is a list of 3; expected a direction other than",
    ),
    "letter in vector": (SHORT + "section:\n  normal:\n  - 0\n  - a\n  - 1\n", "line 10: section.normal[1] is 'a'; expected a number"),
    "samples": (SHORT + "discretisation: {samples: 4}\n", "line 7: discretisation.samples is '4'; expected a number greater than or equal"),
    "twice": (SHORT + "out: a\nout: b\n", "line 8: out is given twice, first on line 7"),
    "twice inside": (SHORT.replace("upper_mm", "lower_mm"), "line 5: tolerance.lower_mm is given twice, first on line 4"),
    "alias": (SHORT + "out: &here x\nrecords: *here\n", "line 7: anchors (&) and aliases (*) are not supported"),
    "tag": (
        SHORT + "out: !!python/object/apply:os.getcwd []\n",
        "line 7: the tag tag:yaml.org,2002:python/object/apply:os.getcwd is not supported",
    ),
    "two documents": (SHORT + "---\nout: x\n", "line 7: a second document begins"),
    "list": ("- part\n- nominal\n", "line 1: found a list of 2; expected keys with values"),
    "text": ("just words\n", "line 1: found 'just words'; expected keys with values"),
    "comment only": ("# nothing here\n", "line 1: found nothing; expected keys with values"),
    "broken": (SHORT + "out: [a\n", "not valid YAML"),
    "tab": ("part:\n\tname: x\n", "line 2: not valid YAML"),
    "deep": ("[" * 3000, "line 1: nested more than 20 deep"),
    "deep mappings": ("{a: " * 3000, "line 1: nested more than 20 deep"),
    "deep keys in a row": ("{" * 3000, "line 1: nested more than 20 deep"),
    "deep after text": (SHORT + "out: x  # " + "[" * 30 + "\nrecords: " + "[" * 22, "line 8: nested more than 20 deep"),
    "deep with words between": ("[a," * 3000, "line 1: nested more than 20 deep"),
    "deep dashes": ("- " * 3000, "line 1: nested more than 20 deep"),
    "deep lines": ("".join(" " * depth + "part:\n" for depth in range(1200)), "line 22: nested more than 20 deep"),
    "key no word": (SHORT + "? [a, b]\n: c\n", "line 7: a key must be a single word"),
    "binary": ("part: \x07\n", "line 1: not a text file (byte 0x07)"),
    "empty": ("", "the file is empty"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistake_is_named_with_file_line_key_and_what_is_allowed(tmp_path: Path, case: str) -> None:
    text, message = MISTAKES[case]
    path = written(tmp_path, text)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_brackets_in_text_are_no_nesting(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, SHORT.replace("blade,", f"'{'[' * 3000}',", 1) + "# " + "{" * 3000))
    assert plan.part.name == "[" * 3000


def test_further_mistakes_are_counted(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"registration\.fit is 'x'; .*\(and 1 more after this one\)$"):
        load_plan(written(tmp_path, SHORT + "registration: {fit: x, method: y}\n"))


def test_missing_plan_and_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"none\.yaml: no such file"):
        load_plan(tmp_path / "none.yaml")
    with pytest.raises(PlanError, match="is a folder; expected a file"):
        load_plan(tmp_path)


PLAN_PIECES = st.lists(
    st.sampled_from(
        [*SHORT.splitlines(), *FULL.splitlines(), "  - 1", "? x", ": y", "&a", "*a", "!!x", "'", '"', "{", "}", "[", "]", "|", "---", "\t"]
    ),
    max_size=12,
).map("\n".join)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(st.binary(max_size=60), st.text(max_size=60).map(str.encode), PLAN_PIECES.map(str.encode)))
@example(content=b"{" * 5000)
@example(content=b"a: " * 300)
@example(content=b"%YAML 9.9\n---\n")
def test_hostile_plan_is_read_or_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(content)
    message = f"{path}: read"
    try:
        load_plan(path)
    except PlanError as error:
        message = str(error)
    assert message.startswith(f"{path}: ")


def test_devices_behind_registers_and_distance_sensors(tmp_path: Path) -> None:
    modbus = load_plan(
        written(tmp_path, SHORT.replace("{type: serial, address: COM3}", "{type: modbus, address: 'h:502', map: mine.yaml}"))
    )
    assert isinstance(modbus.device, ModbusDevice)
    assert (modbus.device.map, modbus.device.timeout_s, modbus.device.parity) == (str(tmp_path / "mine.yaml"), 1.0, "E")
    fed = "{type: serial, address: COM3, format: riftek, options: {range_mm: 50, rate_hz: 1000}, axis: {feed_mm_s: 10}}"
    sensor = load_plan(written(tmp_path, SHORT.replace("{type: serial, address: COM3}", fed))).device
    assert isinstance(sensor, SerialDevice)
    assert sensor.axis is not None
    assert (sensor.format, sensor.options, sensor.axis.feed_mm_s) == ("riftek", {"range_mm": 50, "rate_hz": 1000}, 10.0)
    with pytest.raises(PlanError, match="either feed_mm_s or follow"):
        load_plan(written(tmp_path, SHORT.replace("{type: serial, address: COM3}", fed.replace("feed_mm_s: 10", ""))))


OWN_MAP = """\
device: "mine: ü"
pattern: latest
status: {at: 0, fields: {state: {at: 0, type: uint16, finished: 0}}}
points: {at: 4, fields: {x: {at: 0, type: int32, scale: 1e-5, offset: -0.0, invalid: 0x80000000}}}
"""


def with_device(folder: Path, device: str) -> Plan:
    return load_plan(written(folder, SHORT.replace("{type: serial, address: COM3}", device)))


@pytest.mark.parametrize("name", ["mymap", "mine.yaml", "maps/mymap", "generic-ring.yaml", "./generic-ring"])
def test_any_name_but_a_shipped_one_is_a_map_beside_the_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    device = with_device(tmp_path, f"{{type: modbus, address: 'h:502', map: {name}}}").device
    assert isinstance(device, ModbusDevice)
    assert device.own_map == tmp_path / name
    assert device.map == str(tmp_path / name)


def test_a_shipped_name_stays_one(tmp_path: Path) -> None:
    (tmp_path / "generic-ring").mkdir()
    device = with_device(tmp_path, "{type: modbus, address: 'h:502', map: generic-ring}").device
    assert isinstance(device, ModbusDevice)
    assert (device.map, device.own_map) == ("generic-ring", None)


def test_an_unknown_map_lists_what_is_shipped(tmp_path: Path) -> None:
    device = with_device(tmp_path, "{type: modbus, address: 'h:502', map: generic-rng}").device
    assert isinstance(device, ModbusDevice)
    with pytest.raises(ValueError, match=r"generic-rng: .*; give a YAML file or one of generic-fifo, generic-ring, gocator, riftek-rf60x"):
        map_of(device.map)


FOLLOWING = "{type: serial, address: COM3, format: riftek, axis: {follow: {type: modbus, address: 'h:502', map: mymap}}}"


@pytest.mark.parametrize("device", ["{type: modbus, address: 'h:502', map: mymap}", FOLLOWING], ids=["device", "followed axis"])
def test_a_map_of_ones_own_is_kept_as_it_was_understood(tmp_path: Path, device: str) -> None:
    (tmp_path / "blade.dat").write_text("0 0", encoding="utf-8")
    (tmp_path / "mymap").write_text(OWN_MAP, encoding="utf-8")
    plan = with_device(tmp_path, device)
    kept = read_model(RunInputs.of(plan).plan, Plan).device
    if isinstance(kept, SerialDevice):
        assert kept.axis is not None
        kept = kept.axis.follow  # type: ignore[assignment]
    assert isinstance(kept, ModbusDevice)
    assert isinstance(kept.map, dict)
    assert map_of(kept.map) == map_of(tmp_path / "mymap")
    assert str(map_of(kept.map).points.fields["x"].offset) == "-0.0"


@pytest.mark.parametrize("name", ["generic-fifo", "generic-ring", "gocator", "riftek-rf60x"])
def test_every_shipped_map_taken_over_as_ones_own_is_kept_exactly(tmp_path: Path, name: str) -> None:
    (tmp_path / "blade.dat").write_text("0 0", encoding="utf-8")
    (tmp_path / "mymap").write_text(yaml.safe_dump(map_of(name).model_dump(mode="json")), encoding="utf-8")
    kept = read_model(RunInputs.of(with_device(tmp_path, "{type: modbus, address: 'h:502', map: mymap}")).plan, Plan).device
    assert isinstance(kept, ModbusDevice)
    assert map_of(kept.map) == map_of(name)


def test_a_map_that_cannot_be_kept_is_a_mistake_in_the_plan(tmp_path: Path) -> None:
    (tmp_path / "blade.dat").write_text("0 0", encoding="utf-8")
    (tmp_path / "mymap").write_text(OWN_MAP.replace("finished: 0", "finished: true"), encoding="utf-8")
    with pytest.raises(PlanError, match=r"mymap: line 3: status\.fields\.state\.finished is 'true'; expected a whole number"):
        RunInputs.of(with_device(tmp_path, "{type: modbus, address: 'h:502', map: mymap}"))
