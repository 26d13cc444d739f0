"""An example of every key of every plan, for messages and the reference: taken from plans that stand here and can be read.

The first plan that has a key gives its example, so that the short ones come first.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import yaml
from pydantic import BaseModel

from cmmlink.plan.scan import Plan
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan
from cmmlink.plan.yaml_model import models_in, type_of

SCAN = """
part: {name: blade 7, serial_number: "B-0042"}
operator: A. Weber
serial_number: {required: true, pattern: B-####}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05, uncertainty_mm: 0.004}
device: {type: serial, address: COM3}
stop_when_failed: true
probe: {tip_radius_mm: 1.0}
section: {origin_mm: [0, 0, 60], normal: [0, 0, 1], x_axis: [1, 0, 0], off_plane_max_mm: 0.5}
registration: {fit: best-fit, method: exact, coverage_min: 0.95, reject_outliers: false}
rule: minimum-zone
weights: arc-length
gap_max_mm: 2
end_allowance_mm: 0.05
allow: {unseen_mm: 1}
decision_rule: iso-14253-1
out: "results/{part}/{serial}_{run}"
report: {language: en, paper: a4, company: Blade Works, logo: logo.png}
records: records
buffer_points: 500000
discretisation: {samples: 10000, pole_angle_min_deg: 178, step_min: 1.0e-4}
temperature: {part_c: 23.5, cte_per_k: 11.5e-6, compensate: true}
characteristics:
  - {name: contour, type: line-profile, zone: {lower_mm: -0.05, upper_mm: 0.05}}
  - {name: nose, type: line-profile, region: LE, within_mm: 15, zone: {width_mm: 0.06, offset_mm: 0.01}, fit: best-fit}
  - {name: chord, type: chord, method: tangent, lower_mm: -0.1, upper_mm: 0.1, nominal_mm: 100, uncertainty_mm: 0.01}
  - {name: chord angle, type: chord-angle, method: nose-tail, lower_deg: -0.1, upper_deg: 0.1, nominal_deg: 12, uncertainty_deg: 0.01}
  - {name: thickness, type: thickness, method: inscribed, lower_mm: -0.05, upper_mm: 0.05}
  - {name: edge, type: edge-thickness, method: tip-arc, edge: leading, offset_mm: 2, lower_mm: -0.05, upper_mm: 0.05}
  - {name: radius, type: edge-radius, method: circle, edge: leading, window_deg: 30, lower_mm: -0.05, upper_mm: 0.05}
  - {name: camber, type: camber, method: inscribed, lower_mm: -0.05, upper_mm: 0.05}
  - {name: twist, type: twist, method: best-fit, lower_deg: -0.1, upper_deg: 0.1}
  - {name: shift, type: displacement, method: best-fit, axis: x, place_mm: [40, 3], lower_mm: -0.1, upper_mm: 0.1}
"""

_MORE_OF_A_SCAN = """
part: {name: blade 7}
nominal: {file: section.dxf, layer: PROFILE, curve: 1, unit: mm, closed: true, material: left}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device:
  type: serial
  address: "192.168.1.10:4001"
  baud_rate: 115200
  parity: N
  format: optoncdt
  options: {range_mm: 50, rate_hz: 2000, count: 8000}
  silence_s: 5
  reconnect_s: 30
  axis: {feed_mm_s: 10, origin_mm: [0, 0, 0], distance_direction: [0, 1, 0], axis_direction: [1, 0, 0]}
registration: {datum: {rotation_deg: 30, translation_mm: [12.5, -3]}}
uncertainty:
  mpe: {a_mm: 0.0018, per_length: 300}
  tip_radius_mm: 0.0005
  repeatability_mm: 0.001
  coverage_factor: 2
  temperature: {part_c: 23.5, reference_c: 20, cte_per_k: 11.5e-6, u_part_k: 0.2, u_cte_per_k: 1.0e-6, compensate: true, fixed_mm: [0, 0]}
characteristics:
  - name: flank
    type: line-profile
    from: {near: [70, 8]}
    to: {feature: LE, offset_mm: -20}
    zone: {stations_mm: [0, 60], lower_mm: [-0.04, -0.06], upper_mm: [0.04, 0.06], between: linear, border_mm: 0.5}
    fit: tolerance
    free: [x, y, rotation]
    limits: {x_mm: [-0.1, 0.1], y_mm: [-0.1, 0.1], rotation_deg: [-0.2, 0.2]}
    pivot_mm: [40, 3]
    x_axis_deg: 30
    filter: {cutoff_mm: 0.8, order: 2, robust: false}
    rule: best-fit
    uncertainty_mm: 0.004
    uncertainty_from: the study nose of 2026-11-02
  - {name: root, type: line-profile, from: {station_mm: 10}, to: {station_mm: 40}, zone: {width_mm: 0.1, outward_mm: 0.04}}
  - {name: smooth chord, type: chord, lower_mm: -0.1, filter: {cutoff_mm: 0.8}}
"""

_OWN_DATUMS = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: file, file: points.csv}
characteristics:
  - name: from the root
    type: line-profile
    zone: {width_mm: 0.1}
    fit: datum
    datum: {line: {from: {station_mm: 10}, to: {station_mm: 40}}, points: [{station_mm: 90}], within_mm: 2}
  - {name: angle, type: chord-angle, datum: {edge: LE, points: [{near: [70, 8]}]}, lower_deg: -0.1}
  - {name: twist, type: twist, datum: {edge: LE, points: [{near: [70, 8]}]}, lower_deg: -0.1}
  - {name: shift, type: displacement, datum: {edge: LE, points: [{near: [70, 8]}]}, lower_mm: -0.1}
"""

_REGISTERS = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device:
  type: modbus
  address: "192.168.1.10:502"
  map: my-controller.yaml
  device_id: 1
  points: 5000
  baud_rate: 19200
  parity: E
  timeout_s: 1
  silence_s: 5
  reconnect_s: 30
  axis: {follow: {type: modbus, address: "192.168.1.11:502", map: my-axis.yaml}}
registration: {datum: {result: fixture/result.json}}
"""

_MACHINE_TOOL = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
probe: {tip_radius_mm: 1.0}
device:
  type: lines
  address: "192.168.1.5:9100"
  listen: true
  unit: mm
  format: {language: g800, result_set: BLADE-7}
  radius_tolerance_mm: 0.002
  silence_s: 300
  reconnect_s: 60
answer:
  file: //dnc/mill-3/O9100.nc
  program: 9100
  variables: {verdict: 150, worst: 151, request: 152}
  characteristics: {chord: 160}
characteristics:
  - {name: chord, type: chord, lower_mm: -0.1, upper_mm: 0.1}
registration: {datum: {rotation_deg: 0, translation_mm: [0, 0]}}
"""

_PRINTED_FILE = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device:
  type: lines
  file: prints/blade.txt
  existing: true
  unit: inch
  format: {pattern: "X(?P<x>[-+ .0-9]+)Y(?P<y>[-+ .0-9]+)", end: M30, points: 200, pass_over: "O[0-9]+", sample: sample.txt,
    request: "REQUEST(?P<number>[ 0-9]+)"}
"""

_PRINTED_LINE = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: lines, address: COM3, baud_rate: 9600, data_bits: 7, parity: E, unit: mm, format: g800}
"""

_FILE = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
device: {type: file, file: points.csv, columns: {x: 2, y: 3}, unit: inch, invalid: [-9999]}
"""

_FILE_WITH_SCALE = (
    _FILE.replace("unit: inch", "scale: 25.4")
    + "registration: {datum: {result: fixture/result.json, run: 20260314-150926-0001, chain_sha256: 0f3a}}\n"
)

_SURFACE = """
part: {name: blade 8}
mesh: {file: blade.stl, unit: mm}
nominal: {file: blade.dat, scale: 60}
tolerance: {lower_mm: -0.1, upper_mm: 0.1}
sections: {normal: [0, 0, 1], heights_mm: [20, 50, 80], nominal_at: [{height_mm: 80, file: tip.dat}]}
cut: {cutter: auto, weld_mm: 1.0e-6, shortest_mm: 5}
stack_characteristics:
  - {name: twist, type: twist, method: best-fit, lower_deg: -0.1, upper_deg: 0.1}
  - {name: untwist, type: relative-twist, method: best-fit, reference_mm: 20, lower_deg: -0.1, upper_deg: 0.1}
  - {name: shift, type: displacement, method: best-fit, axis: total, place_mm: [40, 3], lower_mm: -0.1, upper_mm: 0.1}
  - {name: bow, type: bow, method: root-tip, place_mm: [40, 3], root_mm: 20, tip_mm: 80, lower_mm: -0.1, upper_mm: 0.1}
  - {name: lean, type: lean, method: least-squares, axis: x, place_mm: [40, 3], lower_deg: -0.1, upper_deg: 0.1}
  - {name: axis, type: stacking-axis, method: straightness, place_mm: [40, 3], upper_mm: 0.1}
  - {name: taper, type: taper, of: chord, method: tangent, nominal: -0.02, lower: -0.001, upper: 0.001, uncertainty: 0.0001}
"""

_MANY_SECTIONS = """
part: {name: blade 8}
mesh: {file: blade.stl, scale: 25.4}
nominal: {file: blade.dat, scale: 60}
tolerance: {lower_mm: -0.1, upper_mm: 0.1}
sections: {every_mm: 0.5, from_mm: 10, to_mm: 90}
registration: {fit: best-fit, method: exact, coverage_min: 0.95}
out: {folder: "results/{part}_{run}", formats: [qif, dfq]}
stack_fit: each
report: {language: en, paper: a4, section_pages: not-conform}
records: {folder: records, key: "E:/key", anchor: //server/share/heads.txt, timestamp: "https://tsa.example", station: hall 2}
"""

_ON_A_MACHINE = """
part: {name: blade 7}
nominal: {file: blade.dat, scale: 100}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
probe: {tip_radius_mm: 1.5}
device:
  type: dme
  address: "192.168.1.10:1294"
  tool: Probe1
  home: false
  coordinate_system: PartCsy
  speed_mm_s: 10
  radius_tolerance_mm: 0.001
  quality_max: 50
  silence_s: 30
  scan: %s
"""
_SCANS_OF_A_MACHINE = (
    "{type: curve, step_mm: 0.1, angle_deg: 10, chord_error_mm: 0.002}",
    "{type: points, step_mm: 1, chord_error_mm: 0.002}",
    "{type: circle, centre_mm: [0, 0, 0], start_mm: [10, 0, 0], axis: [0, 0, 1], sweep_deg: 360, surface: outside, step_deg: 0.5}",
    "{type: line, start_mm: [0, 0, 0], end_mm: [20, 0, 0], normal: [0, 1, 0], step_mm: 0.1}",
    "{type: unknown, start_mm: [0, 0, 0], start_direction: [0, 1, 0], plane_normal: [0, 0, 1], towards_mm: [2, 0, 0], step_mm: 0.1, "
    "end_mm: [9, 0, 0], end_diameter_mm: 1.4, end_count: 1, end_direction: [0, 1, 0], dialect: 1.4.3}",
)

_WHOLE_SURFACE = """
part: {name: blade 9}
surface: {file: blade.stl, scale: 1, chord_mm: 0.01}
tolerance: {lower_mm: -0.1, upper_mm: 0.1, uncertainty_mm: 0.005}
device: {type: file, file: scan.csv}
registration:
  fit: best-fit
  start: {rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation_mm: [12.5, -3, 40]}
  locked: [z]
  coverage_min: 0.95
  reject_outliers: false
  gross_mm: 2
gap_max_mm: 3
edge_allowance_mm: 0.05
allow: {unseen_mm: 1}
"""

_SURFACE_IN_INCHES = """
part: {name: blade 9}
operator: A. Weber
serial_number: {required: true, pattern: B-####}
surface: {file: blade.ply, unit: inch}
tolerance: {lower_mm: -0.1, upper_mm: 0.1}
decision_rule: iso-14253-1
device: {type: serial, address: COM3}
probe: {tip_radius_mm: 1.0}
buffer_points: 500000
out: "results/{part}/{serial}_{run}"
report: {language: en}
records: records
"""

_STRIPS_ON_A_MACHINE = """
part: {name: wall}
surface: {file: wall.stp}
tolerance: {lower_mm: -0.05, upper_mm: 0.05}
probe: {tip_radius_mm: 1.5}
device:
  type: dme
  address: "192.168.1.10:1294"
  coordinate_system: PartCsy
  scans:
    - {type: line, start_mm: [0, 0, 0], end_mm: [80, 0, 0], normal: [0, -1, 0], step_mm: 0.5}
    - {type: line, via_mm: [[80, -20, 0], [80, -20, 10]], start_mm: [80, 0, 10], end_mm: [0, 0, 10], normal: [0, -1, 0], step_mm: 0.5}
registration: {fit: none}
"""

PLANS: tuple[tuple[type[BaseModel], str], ...] = (
    (Plan, SCAN),
    (CtPlan, _SURFACE),
    (Plan, _REGISTERS),
    (Plan, _PRINTED_LINE),
    (Plan, _MACHINE_TOOL),
    (Plan, _PRINTED_FILE),
    (Plan, _FILE),
    (Plan, _FILE_WITH_SCALE),
    (Plan, _MORE_OF_A_SCAN),
    (Plan, _OWN_DATUMS),
    (CtPlan, _MANY_SECTIONS),
    (SurfacePlan, _WHOLE_SURFACE),
    (SurfacePlan, _SURFACE_IN_INCHES),
    (SurfacePlan, _STRIPS_ON_A_MACHINE),
    *((Plan, _ON_A_MACHINE % scan) for scan in _SCANS_OF_A_MACHINE),
)


def example_of(model: type[BaseModel], key: str) -> str:
    """A line that a key may stand on, like `lower_mm: -0.05`; empty where there is no such key."""
    known = _examples()
    value = next((known[kind, key] for kind in model.__mro__ if (kind, key) in known), None)
    return "" if value is None else _spell(key, value)


def example_at(model: type[BaseModel], name: str, of_type: str = "") -> str:
    """The same for a dotted key of a plan, and the type of the mapping that it belongs to where several may stand there."""
    *groups, key = name.split(".")
    owners = [model]
    for group in groups:
        fields = [field for owner in owners for inner, field in owner.model_fields.items() if group in (inner, field.alias)]
        owners = [inner for field in fields for inner in models_in(field.annotation)]
    of_that_type = [owner for owner in owners if type_of(owner) == of_type] or owners
    return next((example for owner in of_that_type if (example := example_of(owner, key))), "")


def _spell(key: str, value: Any) -> str:
    """One key on one line. A list of mappings shows its first."""
    shown = value[:1] if isinstance(value, list) and value and isinstance(value[0], dict) else value
    return f"{key}: {yaml.safe_dump(shown, default_flow_style=True, sort_keys=False, width=10_000).removesuffix('...' + chr(10)).strip()}"


@lru_cache(maxsize=1)
def _examples() -> dict[tuple[type, str], Any]:
    """The first value of every key of every model, as it stands in the plans."""
    found: dict[tuple[type, str], Any] = {}
    for model, text in PLANS:
        written = yaml.safe_load(text)
        for kind, key, value in _values(model.model_validate(written), written):
            found.setdefault((kind, key), value)
    return found


def _values(read: Any, written: Any) -> Iterator[tuple[type, str, Any]]:
    """Every key that is written, with its value and each model that has it, from the top down."""
    if isinstance(read, BaseModel) and isinstance(written, dict):
        for name, field in type(read).model_fields.items():
            key = field.alias or name
            if key in written:
                yield from ((kind, key, written[key]) for kind in type(read).__mro__ if name in getattr(kind, "model_fields", ()))
                yield from _values(getattr(read, name), written[key])
    elif isinstance(read, (list, tuple)) and isinstance(written, list):
        for inner, of in zip(read, written, strict=True):
            yield from _values(inner, of)
