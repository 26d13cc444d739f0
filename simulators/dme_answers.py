"""What the commands of I++ DME do to a simulated machine. Each is a generator, which begins to work when it is its turn."""

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType

import numpy as np

from simulators.dme_language import (
    ERRORS,
    Call,
    Refused,
    Word,
    axis_values,
    names_of,
    numbers_of,
    spelled,
    text_of,
    without_arguments,
)
from simulators.dme_scans import MEASURED, Step
from simulators.dme_state import SYSTEMS, Daemon, State
from simulators.dme_tools import Tool, answer, change

VERSION, MACHINE = "1.4", "CartCMM"
_MEASURING = SYSTEMS[:4]
_AXES = frozenset({"X", "Y", "Z", "R", "Tool.A", "Tool.B", "Tool.C"})
_POINT_COLUMNS = _AXES | {"IJK", "ER", "Q"}


def _start_session(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    if machine.in_session:
        raise Refused(8)
    machine.in_session, machine.in_error = True, False
    machine.forget_reports()
    yield from ()


def _end_session(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    machine.in_session = machine.in_error = False
    machine.daemons.clear()
    yield from ()


def _clear(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    machine.in_error = False
    yield from ()


def _unary_hint(machine: State, _: str, call: Call) -> Iterator[Step]:
    if len(call.arguments) != 1:
        raise Refused(502)
    if not isinstance(call.arguments[0], float) or call.arguments[0] <= 0:
        raise Refused(509)
    yield from ()


def _binary_hint(machine: State, _: str, call: Call) -> Iterator[Step]:
    numbers_of(call, 2)
    yield from ()


def _home(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    yield from machine.move(np.zeros(3))
    machine.homed = True


def _enable(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    machine.user_enabled = call.name == "EnableUser"
    yield from ()


def _error_info(machine: State, _: str, call: Call) -> Iterator[Step]:
    if len(call.arguments) != 1:
        raise Refused(502)
    [code] = call.arguments
    if not isinstance(code, float) or code != int(code):
        raise Refused(509)
    if int(code) not in ERRORS:
        raise Refused(504)
    yield Step(0.0, f'"{ERRORS[int(code)][1]}"')


def _tools(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    for name in machine.tools:
        yield Step(0.0, f'"{name}"')


def _change_tool(machine: State, _: str, call: Call) -> Iterator[Step]:
    name = text_of(call)
    if name == "UnDefTool":
        raise Refused(1503)
    if name not in machine.tools:
        raise Refused(1502)
    if call.name == "FindTool":
        machine.found_tool = machine.tools[name]
    else:
        machine.tool = machine.tools[name]
    yield from ()


def _get_property(machine: State, _: str, call: Call) -> Iterator[Step]:
    if not call.arguments or not all(isinstance(one, Call) for one in call.arguments):
        raise Refused(502)
    found = [_tool_of(machine, one) for one in call.arguments]
    yield Step(0.0, ", ".join(answer(tool, prefix, one) for (prefix, tool), one in zip(found, call.arguments, strict=True)))


def _set_property(machine: State, _: str, call: Call) -> Iterator[Step]:
    if not call.arguments:
        raise Refused(502)
    for one in call.arguments:
        prefix, tool = _tool_of(machine, one)
        change(tool, prefix, one)
    yield from ()


def _tool_of(machine: State, asked: object) -> tuple[str, Tool]:
    is_found = isinstance(asked, Call) and asked.name.startswith("FoundTool.")
    return ("FoundTool", machine.found_tool) if is_found else ("Tool", machine.tool)


def _get(machine: State, _: str, call: Call) -> Iterator[Step]:
    yield Step(0.0, machine.places(names_of(call, _AXES)))


def _go_to(machine: State, _: str, call: Call) -> Iterator[Step]:
    values = axis_values(call, _AXES, 502)
    if not machine.homed:
        raise Refused(507)
    yield from machine.move(machine.target(values))


def _report_points(machine: State, _: str, call: Call) -> Iterator[Step]:
    columns = names_of(call, _POINT_COLUMNS - ({"Q"} if call.name == "OnPtMeasReport" else set()))
    if call.name == "OnScanReport":
        machine.scan_columns = columns
    else:
        machine.point_columns = columns
    yield from ()


def _report_moves(machine: State, tag: str, call: Call) -> Iterator[Step]:
    if machine.daemons:
        raise Refused(515)
    every_s, distance_mm, axes = np.inf, np.inf, []
    for one in call.arguments:
        if isinstance(one, Call) and one.name in ("Time", "Dis"):
            if len(one.arguments) != 1 or not isinstance(one.arguments[0], float):
                raise Refused(509)
            if one.arguments[0] < (0.1 if one.name == "Time" else 1e-9):
                raise Refused(510)
            every_s = one.arguments[0] if one.name == "Time" else every_s
            distance_mm = one.arguments[0] if one.name == "Dis" else distance_mm
        elif isinstance(one, Call) and not one.arguments and one.name in _AXES and one.name not in axes:
            axes.append(one.name)
        else:
            raise Refused(502)
    names = [one.name for one in call.arguments if isinstance(one, Call)]
    if len(set(names)) != len(names):
        raise Refused(502)
    machine.daemons[tag] = Daemon(axes, float(every_s), float(distance_mm), reported_mm=machine.place_mm)
    yield from ()


def _stop_daemon(machine: State, _: str, call: Call) -> Iterator[Step]:
    if call.name == "StopAllDaemons":
        without_arguments(call)
        machine.daemons.clear()
        return
    if len(call.arguments) != 1:
        raise Refused(502)
    [tag] = call.arguments
    if not isinstance(tag, Word) or not tag.value.startswith("E"):
        raise Refused(509)
    if machine.daemons.pop(tag.value, None) is None:
        raise Refused(513)
    yield from ()


def _choose_system(machine: State, _: str, call: Call) -> Iterator[Step]:
    if len(call.arguments) != 1:
        raise Refused(502)
    [name] = call.arguments
    if not isinstance(name, Word) or name.value not in _MEASURING:
        raise Refused(502)
    machine.system = name.value
    yield from ()


def _transformation(machine: State, _: str, call: Call) -> Iterator[Step]:
    setting = call.name == "SetCsyTransformation"
    if len(call.arguments) != (7 if setting else 1):
        raise Refused(502)
    name, *values = call.arguments
    if not isinstance(name, Word) or name.value == SYSTEMS[0]:
        raise Refused(502)
    if name.value not in SYSTEMS:
        raise Refused(509)
    if not setting:
        told = ", ".join(map(spelled, machine.transformations[name.value]))
        yield Step(0.0, f"GetCsyTransformation({told})")
        return
    numbers = tuple(value for value in values if isinstance(value, float))
    if len(numbers) != 6:
        raise Refused(502)
    if not 0.0 <= numbers[3] <= 180.0:
        raise Refused(1007)
    machine.transformations[name.value] = numbers


def _say(machine: State, _: str, call: Call) -> Iterator[Step]:
    without_arguments(call)
    said = {
        "GetDMEVersion": [f'DMEVersion("{VERSION}")'],
        "GetMachineClass": [f'GetMachineClass("{MACHINE}")'],
        "IsHomed": [f"IsHomed({int(machine.homed)})"],
        "IsUserEnabled": [f"IsUserEnabled({int(machine.user_enabled)})"],
        "GetErrStatusE": [f"ErrStatus({int(machine.in_error)})"],
        "GetXtdErrStatus": [f"IsUserEnabled({int(machine.user_enabled)})", f"IsHomed({int(machine.homed)})"],
        "GetCoordSystem": [f"CoordSystem({machine.system})"],
    }
    for line in said[call.name]:
        yield Step(0.0, line)


def _density(machine: State, _: str, call: Call) -> Iterator[Step]:
    parts = {one.name: one.arguments for one in call.arguments if isinstance(one, Call)}
    given = parts.get("Dis", ())
    if len(parts) != len(call.arguments) or not set(parts) <= {"Dis", "Angle", "AtNominals"}:
        raise Refused(502)
    if len(given) != 1 or not isinstance(given[0], float) or given[0] <= 0:
        raise Refused(509)
    machine.density_mm = given[0]
    yield from ()


def _measure(machine: State, _: str, call: Call) -> Iterator[Step]:
    yield from MEASURED[call.name](machine, call)


Carry = Callable[[State, str, Call], Iterator[Step]]
CARRIED_OUT: Mapping[str, Carry] = MappingProxyType(
    {
        "StartSession": _start_session,
        "EndSession": _end_session,
        "ClearAllErrors": _clear,
        "Home": _home,
        "EnableUser": _enable,
        "DisableUser": _enable,
        "GetErrorInfo": _error_info,
        "EnumTools": _tools,
        "Get": _get,
        "GoTo": _go_to,
        "OnMoveReportE": _report_moves,
        "GetCsyTransformation": _transformation,
        "SetCsyTransformation": _transformation,
        "SetCoordSystem": _choose_system,
        "SetProp": _set_property,
        "ScanOnCurveDensity": _density,
        "ScanUnknownDensity": _density,
        "ScanUnknownHint": _unary_hint,
        **dict.fromkeys(("ScanOnCircleHint", "ScanOnLineHint", "ScanOnCurveHint"), _binary_hint),
        **dict.fromkeys(("ChangeTool", "SetTool", "FindTool"), _change_tool),
        **dict.fromkeys(("GetProp", "GetPropE"), _get_property),
        **dict.fromkeys(("OnPtMeasReport", "OnScanReport"), _report_points),
        **dict.fromkeys(("StopDaemon", "StopAllDaemons"), _stop_daemon),
        **dict.fromkeys(
            ("GetDMEVersion", "GetMachineClass", "IsHomed", "IsUserEnabled", "GetErrStatusE", "GetXtdErrStatus", "GetCoordSystem"),
            _say,
        ),
        **dict.fromkeys(MEASURED, _measure),
    }
)
KNOWN = frozenset(  # of the specification, and more than this machine can
    {
        "AlignPart",
        "AlignTool",
        "CenterPart",
        "EnumAllProp",
        "EnumProp",
        "GetChangeToolAction",
        "LockAxis",
        "ReQualify",
        "ScanInCylEndIsPlane",
        "ScanInCylEndIsSphere",
        "ScanInPlaneEndIsCyl",
        "ScanInPlaneEndIsPlane",
        "TiltCenterPart",
        "TiltPart",
    }
)
