"""Characteristics as QIF spells them: what is asked in a definition, a nominal and an item, and what was found in a measurement.

A profile is a line profile of the standard; numbers of a section, which it has no kinds for, are user-defined ones, linear or angular or
with a unit of their own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from cmmlink.exports.measured_part import MeasuredSection
from cmmlink.exports.tables import reasons_in
from cmmlink.exports.xml_stream import Value, XmlStream

RATIO = "mm/mm"  # the unit of what has none, as taper
_COVERAGE_FACTOR = 2.0  # of the expanded uncertainty U of a characteristic, about 95 %
_STATUS = {"conform": "PASS", "nonconform": "FAIL", "uncertain": "INDETERMINATE"}
_SYMMETRIC = 1e-9  # of the width of a zone

Kind = Literal["LineProfile", "UserDefinedLinear", "UserDefinedAngular", "UserDefinedUnit"]


@dataclass(frozen=True, slots=True)
class Curve:
    """A section with the ids of what it is in the document: the feature of a profile, and each set of its points."""

    section: MeasuredSection
    definition: int
    nominal: int
    item: int
    measurement: int
    sets: Sequence[int]


@dataclass(frozen=True, slots=True)
class Numbered:
    """A characteristic with the ids of its definition, nominal, item and measurement.

    found    : what result.json says of it
    name     : its name, with the section where there are many
    curves   : the sections that it is of
    extremes : of a profile the largest and the smallest deviation, where both are known at its pose
    """

    found: Mapping[str, Any]
    name: str
    curves: Sequence[Curve]
    definition: int
    nominal: int
    item: int
    measurement: int
    extremes: tuple[float, float] | None = None

    @classmethod
    def of(
        cls,
        found: Mapping[str, Any],
        name: str,
        curves: Sequence[Curve],
        ids: Iterator[int],
        extremes: tuple[float, float] | None = None,
    ) -> "Numbered":
        """A characteristic with the next ids."""
        return cls(found, name, curves, next(ids), next(ids), next(ids), next(ids), extremes)

    @property
    def kind(self) -> Kind:
        """What it is by the standard."""
        found = self.found
        if found["type"] == "line-profile" and None not in (found["lower"], found["upper"]):
            return "LineProfile"
        if found["unit"] == "deg":
            return "UserDefinedAngular"
        return "UserDefinedUnit" if has_own_unit(found) else "UserDefinedLinear"

    def element(self, what: str) -> str:
        """The name of its element."""
        return f"{self.kind}Characteristic{what}"


def has_own_unit(found: Mapping[str, Any]) -> bool:
    """Whether it is a ratio; without a nominal value it has no number that a unit could belong to."""
    return bool(found["unit"] == "1" and found["nominal"] is not None)


def write_definition(x: XmlStream, one: Numbered) -> None:
    """What is asked for, with its tolerance."""
    found = one.found
    with x(one.element("Definition"), id=one.definition):
        x.leaf("Name", one.name)
        if one.kind == "LineProfile":
            width = found["upper"] - found["lower"]
            x.leaf("ToleranceValue", width)
            if abs(found["upper"] + found["lower"]) > _SYMMETRIC * width:
                x.leaf("OuterDisposition", found["upper"])
        elif one.kind != "UserDefinedUnit":
            limits = _limits(found)
            if limits:
                with x("Tolerance"):
                    _write_limits(x, limits)
            else:
                x.leaf("NonTolerance", "MEASURED")
            x.leaf("WhatToMeasure", f"{found['type']}: {found['method']}")


def write_nominal(x: XmlStream, one: Numbered) -> None:
    """The nominal value, and the curves that it is of."""
    nominal, unit = one.found["nominal"], {"unitName": RATIO} if one.kind == "UserDefinedUnit" else {}
    with x(one.element("Nominal"), id=one.nominal):
        x.leaf("CharacteristicDefinitionId", one.definition)
        _write_ids(x, "FeatureNominalIds", [curve.nominal for curve in one.curves])
        if one.kind == "LineProfile":
            x.leaf("Vector", "0 0 1")
        elif nominal is not None:
            x.leaf("TargetValue", nominal, **unit)
            if one.kind == "UserDefinedUnit":
                _write_limits(x, _limits(one.found), **unit)


def write_item(x: XmlStream, one: Numbered) -> None:
    """What is to be measured."""
    with x(one.element("Item"), id=one.item):
        x.leaf("Name", one.name)
        _write_ids(x, "FeatureItemIds", [curve.item for curve in one.curves])
        x.leaf("CharacteristicNominalId", one.nominal)


def write_measurement(x: XmlStream, one: Numbered, time: str, component: int) -> None:
    """What was found: a status, and a value where there is one."""
    found = one.found
    with x(one.element("Measurement"), id=one.measurement):
        write_attributes(x, _told(found))
        with x("Status"):
            x.leaf("CharacteristicStatusEnum", _STATUS[found["verdict"]])
        x.leaf("CharacteristicItemId", one.item)
        x.leaf("TimeStamp", time)
        _write_ids(x, "FeatureMeasurementIds", [curve.measurement for curve in one.curves])
        x.leaf("ActualComponentId", component)
        if found["value"] is not None:
            _write_value(x, one)


def _write_value(x: XmlStream, one: Numbered) -> None:
    found = one.found
    attributes: dict[str, Value] = {"unitName": RATIO} if one.kind == "UserDefinedUnit" else {}
    if found["uncertainty"]:
        attributes["combinedUncertainty"] = found["uncertainty"] / _COVERAGE_FACTOR
    x.leaf("Value", found["value"], **attributes)
    if one.kind == "LineProfile" and one.extremes is not None:
        x.leaf("WorstPositiveDeviation", one.extremes[0])
        x.leaf("WorstNegativeDeviation", one.extremes[1])


def write_attributes(x: XmlStream, told: Mapping[str, Value]) -> None:
    """The attributes that may open an element."""
    with x("Attributes", n=len(told)):
        for name, value in told.items():
            x.leaf("AttributeStr", name=name, value=value)


def _told(found: Mapping[str, Any]) -> dict[str, Value]:
    """What a value depends on, and why its status is what it is."""
    keys = ("type", "method", "fit", "filter", "weights", "rule", "region_words", "zone", "deviation", "coverage", "largest_gap_mm")
    told: dict[str, Value] = {key: found[key] for key in keys if found[key] not in (None, "")}
    if found["uncertainty"]:
        told["expanded_uncertainty"] = found["uncertainty"]
    if found["reasons"]:
        told["reasons"] = reasons_in(found)
    return told


def _limits(found: Mapping[str, Any]) -> dict[str, float]:
    """The limits of the deviation that there are, by the names of their elements."""
    given = {"MaxValue": found["upper"], "MinValue": found["lower"]}
    return {name: limit for name, limit in given.items() if limit is not None}


def _write_limits(x: XmlStream, limits: Mapping[str, float], **unit: Value) -> None:
    for name, limit in limits.items():
        x.leaf(name, limit, **unit)
    x.leaf("DefinedAsLimit", False)


def _write_ids(x: XmlStream, name: str, ids: Sequence[int]) -> None:
    with x(name, n=len(ids)):
        for number in ids:
            x.leaf("Id", number)
