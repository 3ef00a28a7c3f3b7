"""What a study cannot mean is refused with file, line, key, value and remedy; cases are in refused_studies.yaml."""

import shutil
from pathlib import Path

import pytest
import yaml

from campaigns import refusal
from tables import study_text

HERE = Path(__file__).parent
REFUSED = {
    f"{study}: {name}": (study, *case)
    for study, cases in yaml.safe_load((HERE / "refused_studies.yaml").read_text()).items()
    for name, case in cases.items()
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_study_is_refused_with_line_key_and_remedy(tmp_path, case):
    study, old, new, *parts = REFUSED[case]
    for path in (HERE.parents[1] / "config/treloar").glob("*.csv"):
        shutil.copy(path, tmp_path)
    (tmp_path / "own.msh").write_text("any")
    message = refusal(tmp_path, new if old is None else study_text(study, (old, new)))
    assert all(line.isprintable() and line.startswith("study.yaml:") for line in message.splitlines())
    for part in parts:
        assert message.startswith(part) if part.startswith("study.yaml") else part in message
