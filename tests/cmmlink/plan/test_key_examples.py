"""Every key of every plan has an example that its model takes, and stands in the reference, the search and the schema."""

import json
import re
from importlib import resources
from pathlib import Path

import jsonschema
import pytest
import yaml
from pydantic import BaseModel

from cmmlink.errors import PlanError
from cmmlink.plan.examples import PLANS, example_of
from cmmlink.plan.key_search import all_keys, keys_named
from cmmlink.plan.reference import groups_of
from cmmlink.plan.scan import Plan
from cmmlink.plan.schema import schema_of_plans
from cmmlink.plan.surface import CtPlan
from cmmlink.plan.whole_surface import SurfacePlan
from cmmlink.plan.yaml_model import models_in

SCHEMA = schema_of_plans()
EDITOR = jsonschema.Draft202012Validator(SCHEMA)
SHIPPED = [file for file in resources.files("cmmlink.demo").joinpath("example_files").iterdir() if file.name.endswith("plan.yaml")]
DOCS = Path(__file__).resolve().parents[3] / "docs"


def all_models() -> set[type[BaseModel]]:
    found: set[type[BaseModel]] = set()
    waiting: list[type[BaseModel]] = [Plan, CtPlan, SurfacePlan]
    while waiting:
        model = waiting.pop()
        if model not in found:
            found.add(model)
            waiting += [inner for field in model.model_fields.values() for inner in models_in(field.annotation)]
    return found


@pytest.mark.parametrize("model", sorted(all_models(), key=str), ids=str)
def test_every_key_has_an_example(model: type[BaseModel]) -> None:
    for name, field in model.model_fields.items():
        assert example_of(model, field.alias or name).startswith(f"{field.alias or name}: "), name


def test_every_key_is_found_by_its_name_with_its_meaning_and_an_example() -> None:
    keys = all_keys()
    described = {key.name for model in (Plan, CtPlan, SurfacePlan) for group in groups_of(model) for key in group.keys}
    assert described == {key.name.rpartition(".")[2] for key in keys}
    for key in keys:
        assert key in keys_named(key.name)
        assert key.meaning
        assert key.example.startswith(f"{key.name.rpartition('.')[2]}: "), key.name
        assert "`" not in "".join(key.lines)


def test_a_key_is_found_by_its_group_by_its_last_word_and_as_a_message_spells_it() -> None:
    names = [key.name.removeprefix("tolerance.") for key in keys_named("tolerance")]
    assert list(dict.fromkeys(names)) == ["tolerance", "lower_mm", "upper_mm", "uncertainty_mm"]
    assert {key.of_type for key in keys_named("baud_rate")} == {"serial", "modbus", "lines"}
    assert [key.name for key in keys_named("characteristics[0].zone.width_mm")] == ["characteristics.zone.width_mm"]
    assert keys_named("heights_mm")[0].plans == ("a CT surface",)
    with pytest.raises(PlanError, match="no plan has a key tolerence; did you mean tolerance"):
        keys_named("tolerence")


@pytest.mark.parametrize("text", [text for _, text in PLANS] + [file.read_text(encoding="utf-8") for file in SHIPPED])
def test_an_editor_takes_every_plan_that_can_be_read(text: str) -> None:
    assert [error.message for error in EDITOR.iter_errors(yaml.safe_load(text))] == []


def test_an_editor_takes_the_plans_of_the_docs() -> None:
    pages = [(DOCS / page).read_text(encoding="utf-8") for page in ("plan.md", "ct-plan.md", "characteristics.md")]
    texts = [text for page in pages for text in re.findall(r"```yaml\n(part:.*?)```", page, re.DOTALL)]
    assert len(texts) > 2
    for text in texts:
        assert [error.message for error in EDITOR.iter_errors(yaml.safe_load(text))] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("lower_mm: -0.05", "lowr_mm: -0.05"),
        ("type: serial", "type: seriell"),
        ("lower_mm: -0.05", "lower_mm: tight"),
        ("rule: min", "rul: min"),
    ],
)
def test_an_editor_marks_what_cannot_be_read(old: str, new: str) -> None:
    text = PLANS[0][1].replace(old, new)
    assert text != PLANS[0][1]
    assert list(EDITOR.iter_errors(yaml.safe_load(text)))


def test_the_schema_is_one_and_is_json() -> None:
    jsonschema.Draft202012Validator.check_schema(json.loads(json.dumps(SCHEMA)))
