"""Files held against the published schemas: QIF against the official one, which lies beside the checkout, and JSON against ours."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from lxml import etree

ROOT = Path(__file__).resolve().parents[3]
QIF_SCHEMA = ROOT.parent / "shared" / "data" / "qif" / "QIFApplications" / "QIFDocument.xsd"
RESULT_SCHEMA = json.loads((ROOT / "docs" / "result.schema.json").read_text(encoding="utf-8"))
NAMES = {"q": "http://qifstandards.org/xsd/qif3"}


@cache
def qif_schema() -> Any:
    return etree.XMLSchema(etree.parse(QIF_SCHEMA)) if QIF_SCHEMA.is_file() else None


def need_qif_schema() -> Any:
    """The official schema; a test that is about validity is skipped without it."""
    if qif_schema() is None:
        pytest.skip(f"no QIF schema at {QIF_SCHEMA}: it may not be shipped")
    return qif_schema()


def check_qif(path: Path) -> list[str]:
    """Validate a document where the schema is there, and give every status in it, in its order."""
    document = etree.parse(path)
    if qif_schema() is not None:
        assert qif_schema().validate(document), qif_schema().error_log
    found = document.xpath("//q:CharacteristicStatusEnum | //q:InspectionStatusEnum", namespaces=NAMES)
    return [element.text for element in found]


def check_result(result: object) -> None:
    """Raise where a result is not as the published schema says."""
    jsonschema.Draft202012Validator(RESULT_SCHEMA).validate(result)
