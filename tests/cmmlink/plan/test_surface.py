"""The plan of a CT inspection: what is refused, by file, line and key."""

from pathlib import Path

import pytest

from cmmlink.errors import PlanError
from cmmlink.plan.surface import load_ct_plan
from tests.drivers.surface.meshes import write


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("sections: {heights_mm: [1], every_mm: 2}", "line 5: sections is a mapping; expected either heights_mm or every_mm"),
        ("sections: {}", "expected either heights_mm or every_mm"),
        ("sections: {heights_mm: [1, x]}", "sections.heights_mm[1] is 'x'; expected a number"),
        ("sections: {heights: [1]}", "sections.heights is not a known key; did you mean heights_mm?"),
        ("sections: {heights_mm: [1], normal: [0, 0, 0]}", "expected a direction other than [0, 0, 0]"),
        ("sections: {heights_mm: [1]}\ncut: {cutter: knife}", "cut.cutter is 'knife'"),
    ],
)
def test_a_bad_plan_is_told_with_its_line_and_key(tmp_path: Path, line: str, message: str) -> None:
    text = "part: {name: b}\nmesh: {file: b.stl}\nnominal: {file: b.dat}\ntolerance: {lower_mm: -1, upper_mm: 1}\n" + line + "\n"
    with pytest.raises(PlanError) as caught:
        load_ct_plan(write(tmp_path / "plan.yaml", text))
    assert message in str(caught.value)
    assert str(tmp_path / "plan.yaml") in str(caught.value)
