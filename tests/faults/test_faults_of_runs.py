"""Operations of a whole run failed: Snakemake's own and its jobs', which are processes of their own."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import driven
import pytest
from injection import FAULTS, operations

REPOSITORY = Path(__file__).parents[2]

SITE = """
import os
from pathlib import Path

from injection import Faults

folder, notes, number, how, report = os.environ["FAULT"].split("|")
Faults(Path(folder), Path(notes), int(number), how, Path(report)).__enter__()
"""
"""What each process of a run starts with."""

SAMPLE = 12
"""Operations of a run that are failed, from its first to its last."""


def run(folder, fault=""):
    """Exit code and output of a run in a folder, with a fault or plain."""
    paths = [*([str(folder.parent / "site"), str(Path(__file__).parent)] if fault else []), str(REPOSITORY / "src")]
    command = [sys.executable, "-m", "snakemake", "--snakefile", REPOSITORY / "Snakefile", "--directory", folder]
    command += ["--workflow-profile", REPOSITORY / "workflow/profiles/default", "--cores", "1"]
    command += ["--configfile", folder / "small.yaml"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "FAULT": fault}
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True, start_new_session=True
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """Folder with what faulty processes start with."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "site").mkdir()
    (folder / "site/sitecustomize.py").write_text(SITE)
    return folder


def started(base, name):
    """A folder with the study without what takes long."""
    folder = base / name
    folder.mkdir()
    text = re.sub(r"(?ms)^(laying|stability|benchmark):\n.*?(?=^\w)", "", driven.STUDY.read_text())
    (folder / "small.yaml").write_text(text.replace("outputs: [size, tables]", "outputs: [tables]"))
    return folder


@pytest.fixture(scope="module")
def complete(base):
    """Operations of a run, and what it makes."""
    folder = started(base, "complete")
    notes = base / "complete.notes"
    code, output = run(folder, f"{folder}|{notes}|0||none")
    assert code == 0, output
    print(f"{len(operations(notes))} operations of a run")
    return len(operations(notes)), driven.contents(folder / "results", logs=False)


@pytest.mark.slow
@pytest.mark.parametrize("place", range(SAMPLE))
def test_a_run_with_a_fault_is_made_good_by_a_plain_one(base, complete, place):
    count, wanted = complete
    number, how = 1 + place * (count - 1) // (SAMPLE - 1), FAULTS[(place + 2) % len(FAULTS)]
    folder = started(base, f"{number}_{how}")
    report, notes = base / f"{number}.txt", base / f"{number}.notes"
    code, output = run(folder, f"{folder}|{notes}|{number}|{how}|{report}")
    told = f"{number} of {count}: " + (report.read_text() if report.exists() else "the operation did not come")
    code, again = run(folder)
    assert code == 0, f"{told}\n{output}\n-- plain:\n{again}"
    found = driven.contents(folder / "results", logs=False)
    assert not driven.differences(found, wanted), f"{told}\n{output}\n-- plain:\n{again}"
    left = [path for path in folder.rglob("*") if "unfinished" in path.name or path.suffix in (".damaged", ".lock")]
    assert not left, f"{told}\n{output}"
    shutil.rmtree(folder)
