"""The reference set: cases whose truth is known by construction, for any program that inspects profiles. This is the front door.

It stands on decimal arithmetic alone and shares nothing with the inspection that it is held against.
"""

TYPE_CHECKING = False  # as type checkers read it; `typing` itself takes longer to load than all of this

if TYPE_CHECKING:
    from cmmlink.reference.case import (
        CaseKind,
        KnownFilter,
        KnownHold,
        KnownPose,
        KnownValue,
        KnownWorst,
        ReferenceCase,
        ReferenceNominal,
        Truth,
    )
    from cmmlink.reference.catalogue import reference_cases
    from cmmlink.reference.scoring import Quantity, quantities, scoring_sheet
    from cmmlink.reference.writing import plan_of, texts_of, write_reference
else:
    from cmmlink.front_door import load_on_use

    _PLACES = {
        "cmmlink.reference.case": (
            "CaseKind",
            "KnownFilter",
            "KnownHold",
            "KnownPose",
            "KnownValue",
            "KnownWorst",
            "ReferenceCase",
            "ReferenceNominal",
            "Truth",
        ),
        "cmmlink.reference.catalogue": ("reference_cases",),
        "cmmlink.reference.scoring": ("Quantity", "quantities", "scoring_sheet"),
        "cmmlink.reference.writing": ("plan_of", "texts_of", "write_reference"),
    }

    __getattr__ = load_on_use(__name__, _PLACES)


__all__ = [
    "CaseKind",
    "KnownFilter",
    "KnownHold",
    "KnownPose",
    "KnownValue",
    "KnownWorst",
    "Quantity",
    "ReferenceCase",
    "ReferenceNominal",
    "Truth",
    "plan_of",
    "quantities",
    "reference_cases",
    "scoring_sheet",
    "texts_of",
    "write_reference",
]
