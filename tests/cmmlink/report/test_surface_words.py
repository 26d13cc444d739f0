"""What is assumed of a surface and why its verdict is what it is: every catalogue has it, whatever part of the program says it."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cmmlink.nominal_files.surface_file import load_surface
from cmmlink.report.speech import Speech
from inspection import Missing, ToleranceZone
from inspection.surface import SurfaceTerms, judge_surface
from tests.drivers.surface.meshes import binary_stl, box

ROOT = Path(__file__).resolve().parents[3]
WHOLE = (
    ROOT / "drivers/scan_file.py",
    *sorted((ROOT / "inspection" / "surface").glob("*.py")),
    ROOT / "inspection/shift_words.py",
    ROOT / "cmmlink/nominal_files/surface_file.py",
    ROOT / "cmmlink/surface_section.py",
)
IN_PART = tuple(ROOT / "drivers/surface" / name for name in ("stl_file.py", "obj_file.py", "open3d_process.py", "ply_cloud.py"))


def is_silent(node: ast.AST) -> bool:
    """Whether a node of a source holds errors, which are told in English, documentation, or what only developers see."""
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return isinstance(node, ast.Raise) or is_text or (isinstance(node, ast.FunctionDef) and node.name == "__repr__")


def tells_notes(node: ast.AST) -> bool:
    """Whether a node gives notes or warnings: an assignment to them, or a function that is called by them."""
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    return "notes" in names or "warnings" in names or (isinstance(node, ast.FunctionDef) and "note" in node.name)


def pieces_of(node: ast.AST, told: bool) -> Iterator[str]:
    """The texts below a node of a source, of f-strings what stands between the places."""
    if is_silent(node):
        return
    told = told or tells_notes(node)
    if told and isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value.strip(" .;:,")
    ends_in_error = isinstance(node, ast.If) and isinstance(node.body[-1], ast.Raise)
    for child in node.orelse if isinstance(node, ast.If) and ends_in_error else ast.iter_child_nodes(node):
        yield from pieces_of(child, told)


def test_german_has_every_note_and_reason_of_surfaces() -> None:
    told = {
        piece
        for paths, whole in ((WHOLE, True), (IN_PART, False))
        for path in paths
        for piece in pieces_of(ast.parse(path.read_text(encoding="utf-8")), whole)
        if len(re.findall(r"[a-z]+ (?=[a-z])", piece)) > 1  # more than a name
    }
    assert len(told) > 70, "the notes were not found"
    catalogue = "\n".join(Speech("de").texts())
    assert sorted(piece for piece in told if piece not in catalogue) == []


def test_notes_and_reasons_as_they_are_put_together_are_german(tmp_path: Path) -> None:
    cube = box((0.0, 0.0, 0.0), (30.0, 18.0, 12.0))
    tilted = cube[:4].copy()
    tilted[..., 2] += 0.5 * tilted[..., 0] - 5.0
    (tmp_path / "odd.stl").write_bytes(binary_stl(np.concatenate([cube[:, ::-1], cube[:1, ::-1], tilted + 1e5])))
    file = load_surface(tmp_path / "odd.stl")
    (tmp_path / "flat.xyz").write_text("".join(f"{x} {y} {x * y / 50}\n" for x in range(12) for y in range(12)), encoding="utf-8")
    cloud = load_surface(tmp_path / "flat.xyz")
    block = load_surface(_written(tmp_path / "block.stl", cube)).nominal
    points = block.sample(3000)[0]
    terms = SurfaceTerms(ToleranceZone(-0.05, 0.05, 0.005, rule="simple"), fit="none", gap_max_mm=3.0, coverage_min=0.9)
    seen = judge_surface(points[points[:, 2] > 1.0] + 0.049995, block, terms, None, False, Missing(3, 7, {"marked invalid": 2}, 9000, 2995))
    told = [f"odd.stl: {note}" for note in file.notes] + [f"flat.xyz: {note}" for note in cloud.notes] + list(seen.notes)
    told += [reason.words for reason in seen.reasons]
    assert len(told) > 12
    german = Speech("de")
    assert [one for one in told if german.sentence(one) == one] == []
    assert german.sentence(told[0]).startswith("odd.stl: ")


def _written(path: Path, triangles: np.ndarray) -> Path:
    path.write_bytes(binary_stl(triangles))
    return path
