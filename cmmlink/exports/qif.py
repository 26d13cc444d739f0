"""QIF 3.0 (ISO 23952): the results of one part as an XML document, valid against the schema of the standard.

What is drawn is one curve a section with its characteristics; what was measured are its points in the nominal's coordinates, their
deviations, and a value and a status for each characteristic. PASS and FAIL are proven; INDETERMINATE is not proven.
"""

import uuid
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from cmmlink.exports.measured_part import MeasuredPart, MeasuredSection
from cmmlink.exports.qif_characteristics import (
    RATIO,
    Curve,
    Numbered,
    write_attributes,
    write_definition,
    write_item,
    write_measurement,
    write_nominal,
)
from cmmlink.exports.tables import reasons_in
from cmmlink.exports.xml_stream import Value, XmlStream
from cmmlink.result_files import NewFiles
from cmmlink.version import __version__
from cmmlink.words import printable
from inspection import NOT_JUDGED

POINTS_OF_A_SET = 50_000  # a text of XML may have ten million letters in libxml2
_NAMES = uuid.UUID("6f0d0d4e-5c1c-5b1f-9d54-0a3d4f2b7c11")  # of cmmlink, for identities that follow from a run
_DEGREE_RAD = 0.017453292519943295
_STATUS = {"conform": "PASS", "nonconform": "FAIL", "uncertain": "UNKNOWN"}


@dataclass(frozen=True, slots=True)
class _Ids:
    """The ids of everything else."""

    standard: int
    software: int
    component: int
    results: int


def write_qif(parts: Sequence[MeasuredPart], files: NewFiles, stem: str) -> None:
    """Write STEM.qif of one part."""
    (part,) = parts
    ids = count(1)
    own = _Ids(next(ids), next(ids), next(ids), next(ids))
    curves = [_numbered(section, ids) for section in part.sections]
    asked = [one for curve in curves for one in _asked_of(curve, ids)]
    asked += [Numbered.of(one, one["name"], curves, ids) for one in part.of_stack]
    with files(f"{stem}.qif").open("w", encoding="utf-8", newline="\n") as file:
        x = XmlStream(file)
        with x("QIFDocument", xmlns="http://qifstandards.org/xsd/qif3", versionQIF="3.0.0", idMax=next(ids) - 1):
            _write_head(x, part, own)
            if curves:
                _write_features(x, curves)
            if asked:
                _write_characteristics(x, asked, own)
            _write_results(x, part, own, curves, asked)


def _numbered(section: MeasuredSection, ids: Iterator[int]) -> Curve:
    judged = sum(int(np.count_nonzero(rows.verdicts != NOT_JUDGED)) for rows in section.blocks())
    feature = (next(ids), next(ids), next(ids), next(ids))
    return Curve(section, *feature, [next(ids) for _ in range(0, judged, POINTS_OF_A_SET)])


def _asked_of(curve: Curve, ids: Iterator[int]) -> Iterator[Numbered]:
    """The characteristics of a section; of the one that judged all its points as they arrived the extremes are known."""
    document = curve.section.document
    for one in document["characteristics"]:
        whole = one["worst"] is not None and one["worst"] == document["worst"] and one["region"] is None and one["filter"] == "none"
        extremes = (document["max_deviation_mm"], document["min_deviation_mm"]) if whole else None
        yield Numbered.of(one, ", ".join(filter(None, [one["name"], curve.section.words])), [curve], ids, extremes)


def _write_head(x: XmlStream, part: MeasuredPart, own: _Ids) -> None:
    identity = " ".join([part.run, part.chain_sha256, printable(part.text("part")), part.text("measured_at")])
    x.leaf("QPId", str(uuid.uuid5(_NAMES, identity)))
    with x("Header"), x("Application"):
        x.leaf("Name", "cmmlink")
    with x("StandardsDefinitions", n=1), x("Standard", id=own.standard):
        with x("Organization"):
            x.leaf("StandardsOrganizationEnum", "ISO")
        x.leaf("Designator", "1101")
    with x("SoftwareDefinitions", n=1), x("Software", id=own.software):
        x.leaf("VendorName", "cmmlink")
        x.leaf("ApplicationName", "cmmlink")
        x.leaf("Version", str((part.identity.get("software") or {}).get("cmmlink") or __version__))
    with x("FileUnits"):
        with x("PrimaryUnits"):
            _write_unit(x, "AngularUnit", "radian", "deg", _DEGREE_RAD)
            _write_unit(x, "LinearUnit", "meter", "mm", 0.001)
        with x("UserDefinedUnits", n=1), x("UserDefinedUnit"):
            x.leaf("WhatIsMeasured", "how a length changes with the height")
            x.leaf("UnitName", RATIO)


def _write_unit(x: XmlStream, kind: str, si: str, name: str, factor: float) -> None:
    with x(kind):
        x.leaf("SIUnitName", si)
        x.leaf("UnitName", name)
        with x("UnitConversion"):
            x.leaf("Factor", factor)


def _write_features(x: XmlStream, curves: Sequence[Curve]) -> None:
    with x("Features"):
        with x("FeatureDefinitions", n=len(curves)):
            for curve in curves:
                x.leaf("OtherCurveFeatureDefinition", id=curve.definition)
        with x("FeatureNominals", n=len(curves)):
            for curve in curves:
                with x("OtherCurveFeatureNominal", id=curve.nominal):
                    x.leaf("FeatureDefinitionId", curve.definition)
        with x("FeatureItems", n=len(curves)):
            for curve in curves:
                with x("OtherCurveFeatureItem", id=curve.item):
                    x.leaf("FeatureNominalId", curve.nominal)
                    x.leaf("FeatureName", curve.section.words or "profile")
                    with x("DeterminationMode"):
                        x.leaf("Checked")


def _write_characteristics(x: XmlStream, asked: Sequence[Numbered], own: _Ids) -> None:
    with x("Characteristics"):
        x.leaf("FormalStandardId", own.standard)
        for group, write in (("Definitions", write_definition), ("Nominals", write_nominal), ("Items", write_item)):
            with x(f"Characteristic{group}", n=len(asked)):
                for one in asked:
                    write(x, one)


def _write_results(x: XmlStream, part: MeasuredPart, own: _Ids, curves: Sequence[Curve], asked: Sequence[Numbered]) -> None:
    with x("Results"):
        with x("MeasurementResultsSet", n=1), x("MeasurementResults", id=own.results):
            write_attributes(x, _told(part))
            _write_traceability(x, part, own)
            _write_measured(x, curves)
            if asked:
                with x("MeasuredCharacteristics"), x("CharacteristicMeasurements", n=len(asked)):
                    for one in asked:
                        write_measurement(x, one, part.text("measured_at"), own.component)
            _write_status(x, "InspectionStatus", part)
        with x("ActualComponentSets", n=1), x("ActualComponentSet", n=1), x("ActualComponent", id=own.component):
            if part.text("serial_number"):
                x.leaf("SerialNumber", part.text("serial_number"))
            _write_status(x, "Status", part)


def _write_traceability(x: XmlStream, part: MeasuredPart, own: _Ids) -> None:
    with x("InspectionTraceability"):
        x.leaf("InspectionStart", part.text("measured_at"))
        with x("InspectionSoftwareItems"), x("AnalysisSoftware", n=1):
            x.leaf("Id", own.software)
        if part.text("operator"):
            with x("InspectionOperator"):
                x.leaf("Name", part.text("operator"))


def _write_status(x: XmlStream, name: str, part: MeasuredPart) -> None:
    with x(name):
        x.leaf("InspectionStatusEnum", _STATUS[part.text("verdict")])


def _told(part: MeasuredPart) -> Mapping[str, Value]:
    """What is told of the measurement beside what the standard has elements for."""
    found = part.document
    keys = ("part", "device", "ending", "verdict", "run", "chain_sha256", "plan_sha256", "nominal_sha256")
    counts = {key: found[key] for key in ("received", "judged", "rejected", "lost", "out_of_tolerance")}
    how = {key: found[key] for key in ("fit", "method", "rule", "weights") if found.get(key)}
    said = {"reasons": reasons_in(found)} if found.get("reasons") else {}
    notes = {f"note {number}": note for number, note in enumerate(part.identity.get("notes") or (), start=1)}
    identity: dict[str, Value] = {key: part.text(key) for key in keys if part.text(key)}
    return identity | {"simulated": bool(part.identity["simulated"])} | counts | how | said | notes


def _write_measured(x: XmlStream, curves: Sequence[Curve]) -> None:
    with x("MeasuredFeatures", n=len(curves)):
        for curve in curves:
            with x("OtherCurveFeatureMeasurement", id=curve.measurement):
                x.leaf("FeatureItemId", curve.item)
                if curve.sets:
                    with x("PointList", n=len(curve.sets)):
                        for number in curve.sets:
                            x.leaf("WholePointSetId", number)
    sets = sum(len(curve.sets) for curve in curves)
    if sets:
        with x("MeasuredPointSets", n=sets):
            for curve in curves:
                for number, (points, deviations) in zip(curve.sets, _point_sets(curve.section), strict=True):
                    with x("MeasuredPointSet", id=number, count=len(points)):
                        x.leaf("Points", _list(points))
                        x.leaf("Compensated", True)
                        x.leaf("Deviations", _list(deviations))


def _list(numbers: NDArray[np.float64]) -> str:
    return " ".join(map(repr, numbers.ravel().tolist()))


def _point_sets(section: MeasuredSection) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """The judged points (k, 3) and their deviations (k,), as many together as a set holds, however they come."""
    waiting: list[NDArray[np.float64]] = []
    for rows in section.blocks():
        judged = rows.verdicts != NOT_JUDGED
        place = np.full(np.count_nonzero(judged), section.height_mm or 0.0)
        waiting.append(np.column_stack([rows.actual_mm[judged], place, rows.deviation_mm[judged]]))
        if sum(map(len, waiting)) >= POINTS_OF_A_SET:
            whole = np.concatenate(waiting)
            full = len(whole) // POINTS_OF_A_SET * POINTS_OF_A_SET
            yield from ((part[:, :3], part[:, 3]) for part in np.split(whole[:full], full // POINTS_OF_A_SET))
            waiting = [whole[full:]]
    rest = np.concatenate(waiting) if waiting else np.empty((0, 4))
    if len(rest):
        yield rest[:, :3], rest[:, 3]
