"""The commands of docs/tasks.md, run one after another in the folder of the example."""

import re
import shlex
from pathlib import Path

import pytest

from tests.cmmlink.command import cmmlink

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tasks.md"


def test_the_commands_of_the_tasks_do_what_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert cmmlink("example", "shop").code == 0
    monkeypatch.chdir(tmp_path / "shop")
    (block,) = re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    said = []
    for line in block.splitlines():
        program, command, *rest = shlex.split(line)
        assert program == "cmmlink"
        kept = [] if command == "plan" or "--records" in rest else ["--records", "kept"]
        ended = cmmlink(command, *rest, *kept)
        assert ended.code == 0, f"{line}: {ended}"
        said.append(ended.out)
    assert said[1].startswith("CONFORM   blade B-001")
    assert said[2].startswith("CONFORM   blade B-002")
    assert said[3].count("CONFORM") == 2
    assert "kept as record" in said[4]
    assert said[-1].startswith("nothing was altered")
