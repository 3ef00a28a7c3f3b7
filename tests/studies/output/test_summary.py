"""What a run says at its end and on its way: the summary of a study, what its jobs have to do, and the display."""

import io
import logging
import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.tests import MockOutputSettings, TestLogHandlerBase

import springtune as st
from snakemake_logger_plugin_springtune import Display, LogHandler
from springtune.safe_io import write_json
from springtune.studies.kinds.bodies.collect import ROOT
from springtune.studies.output import summary
from springtune.studies.runs import plan

from tables import STUDIES, beside, cases

AXES = beside(__file__)["AXES"]


def cell(**chosen):
    return {name: chosen.get(name, labels[0]) for name, labels in AXES.items() if name != "stiffness_ratio"}


@pytest.fixture
def rows():
    """Four scenes on one beam and one on the other: solved by 1 % and -20 %, one each of what may go wrong."""
    references, scenes = beside(__file__)["rows"][:2], beside(__file__)["rows"][2:]
    return [*map(dict, references), *(cell() | scene for scene in scenes)]


@pytest.fixture
def root(rows):
    return ROOT.of_rows(AXES, rows)


def told(root):
    """Summary of a dataset of scenes alone."""
    return summary.text({"/": root}, "A study")


class TestText:
    def test_counts_holes_and_errors(self, root):
        lines = told(root).splitlines()
        assert lines[0] == "A study"
        assert "  scenes  5  2 solved, 1 not converged, 1 unstable, 1 failed" in lines
        assert "  100x20, free, 5 mm, steel, traction, lattice, linear: residual 1e-3" in lines
        assert "  80x10, free, 1 mm, steel, traction, lattice, linear: refuses the mesh" in lines
        assert lines[-1].startswith("Not everything is solved: 3 of 5 scenes.")
        # The unstable scene's error of 500 % is none; the largest error comes first.
        errors = [" ".join(line.split()[:9]) for line in lines if " %" in line]
        assert errors == ["patch linear 1 20 % -20 % too stiff", "lattice linear 1 1 % +1 % too soft"]

    def test_a_word_turns_with_the_displacement(self, root):
        root["reference_displacement"].values[...] *= -1  # pulled down
        text = told(root)
        assert "-20 %  too soft" in text and "+1 %  too stiff" in text

    def test_scenes_without_a_reference_are_named(self, rows):
        rows[1] |= {"reference_displacement": np.nan, "reference_message": "no reference: too slender"}
        text = told(ROOT.of_rows(AXES, rows))
        assert "without a reference, and so without an error: 1 of 5\n  80x10, steel, traction: no reference" in text

    def test_scenes_beyond_small_strain_are_named(self, rows):
        rows[0] |= {"reference_applies": 0, "reference_message": "it turns by 1 rad"}
        text = told(ROOT.of_rows(AXES, rows))
        assert "beyond small strain, so the error is not the network's alone: 3 of 5" in text
        assert "100x20, steel, traction: it turns by 1 rad" in text and "worst" not in text

    def test_a_few_are_named_of_many_and_of_each_reason_one_first(self):
        beams = [f"beam-{letter}" for letter in "abcdefghij"]
        whys = [*(f"residual {number}.5e-3" for number in range(9)), "refused"]
        rows = [cell(beam=beam) | {"status": st.Status.FAILED, "message": why} for beam, why in zip(beams, whys)]
        root = ROOT.of_rows(AXES | {"beam": beams}, rows)
        lines = told(root).splitlines()
        named = lines[lines.index("scenes, failed: 10 of 10") + 1 :][:4]
        assert [line.partition(",")[0].strip() for line in named] == ["beam-a", "beam-j", "beam-b", "and 7 more"]


STUDY = STUDIES["summary"]


@pytest.fixture
def planned(tmp_path):
    """A study, its plan, and the names of its jobs."""
    (tmp_path / "two.yaml").write_text(STUDY)
    study, folder = st.load_study(tmp_path / "two.yaml"), tmp_path / "results/two"
    made = plan.jobs(study, folder)
    return study, made, [name for name, job in made.items() if job.stage]


def mark_done(made, name, computed, moment):
    """Mark a job done at a time."""
    write_json(made[name].record, {"digest": made[name].digest, "computed": computed})
    os.utime(made[name].record, (moment, moment))


class TestEnding:
    def finish(self, planned, new):
        """Mark all bundles done, those of the stages in `new` now, the others before."""
        study, made, names = planned
        since = time.time() - 100
        for name in names:
            count = len(made[name].results)
            mark_done(made, name, count, since + (50 if name.startswith(new) else -50))
        return summary.success_report(study, made, since), made["collect"].folder, since

    def test_says_what_is_new_and_where_it_is(self, planned):
        folder = planned[1]["collect"].folder
        (folder / "figures").mkdir(parents=True)
        (folder / "dataset.nc").touch()
        (folder / plan.SUMMARY).write_text("Told before\n")
        text, *_ = self.finish(planned, "solve")
        assert "Told before" in text and "new      solve 4 of 4; the others were stored before" in text
        assert f"results  {folder}: dataset.nc, figures/" in text
        assert "new      nothing: all results were stored before" in self.finish(planned, "none")[0]

    def test_a_summary_older_than_the_results_is_not_shown(self, planned):
        folder = planned[1]["collect"].folder
        folder.mkdir(parents=True)
        (folder / plan.SUMMARY).write_text("Told before\n")
        os.utime(folder / plan.SUMMARY, (0, 0))
        text, *_ = self.finish(planned, "solve")
        assert "Told before" not in text and "The dataset is older than these results." in text

    def test_what_broke_is_named(self, planned):
        (study, made, names), folder = planned, planned[1]["collect"].folder
        _, _, since = self.finish(planned, "solve")
        made[names[-1]].record.unlink()
        (folder / "logs").mkdir()
        (folder / "logs" / f"{names[-1]}.log").write_text("why")
        text = summary.failure_report(study, made, since)
        assert "two is not complete" in text and f"logs/{names[-1]}.log" in text and text.count(".log") == 1
        (folder / "logs/collect.log").write_text("why, too")
        assert "logs/collect.log" in summary.failure_report(study, made, since)
        besides = summary.other_study_report(study, made, since)
        assert "new in two: " in besides and f"not complete: {names[-1]}" in besides and besides.count(".log") == 2


class Terminal(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


def handler(monkeypatch, stream, ci="", **chosen):
    """Handler that writes to a stream; not a fixture, since pytest captures a test's own streams."""
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("CI", ci)
    settings = MockOutputSettings()
    vars(settings).update({"printshellcmds": False, "nocolor": True} | chosen)
    made = LogHandler(common_settings=settings, settings=None)
    made.setFormatter(logging.Formatter("%(message)s"))
    return made


def record(message, level=logging.INFO, **more):
    made = logging.LogRecord("snakemake", level, "x.py", 1, message, (), None)
    vars(made).update(more)
    return made


def emit_run(made, error=""):
    """Records of a run of three jobs, the last of which may fail."""
    rules = {1: "mesh", 2: "mesh", 3: "solve"}
    made.emit(record("Building DAG of jobs..."))
    made.emit(record("Job stats:", event=LogEvent.RUN_INFO, stats={"mesh": 2, "solve": 1, "total": 3}))
    for number, rule in rules.items():
        made.emit(record("Select jobs to execute..."))
        made.emit(record("Job: message", event=LogEvent.JOB_INFO, jobid=number, rule_name=rule))
        if error and number == 3:
            made.emit(record(error, logging.ERROR, event=LogEvent.JOB_ERROR, jobid=number))
        else:
            made.emit(record("Finished job", event=LogEvent.JOB_FINISHED, job_id=number))
        made.emit(record("1 of 3 steps done", event=LogEvent.PROGRESS))
    made.emit(record("what became of it", ends=True))
    made.emit(record("Complete log(s)"))
    made.close()


class TestHandler(TestLogHandlerBase):
    """With all that the interface's own tests ask of a plugin."""

    __test__ = True

    def get_log_handler_cls(self):
        return LogHandler

    def get_log_handler_settings(self):
        return None

    @pytest.mark.parametrize("stream", [io.StringIO, Terminal])
    def test_elsewhere_than_on_terminals_a_run_is_a_line_a_rule(self, monkeypatch, stream):
        made = stream()
        emit_run(handler(monkeypatch, made, ci="true"))
        assert made.getvalue().splitlines() == [
            "3 jobs",
            "mesh: done; 2 of 3 jobs, 0 s, about 0 s left",
            "solve: done; 3 of 3 jobs, 0 s",
            "what became of it",
            "Complete log(s)",
        ]

    def test_on_a_terminal_one_line_moves_and_then_the_end_is_there(self, monkeypatch):
        made = Terminal()
        emit_run(handler(monkeypatch, made))
        head, *moving, end = re.split(r"\r\x1b\[\?7l", made.getvalue())
        assert head == "3 jobs\n" and all("\n" not in line for line in moving)
        assert end == "\x1b[K\x1b[?7hwhat became of it\nComplete log(s)\n"

    @pytest.mark.parametrize("stream", [io.StringIO, Terminal])
    def test_errors_of_jobs_are_shown_as_snakemake_writes_them(self, monkeypatch, stream):
        made = stream()
        emit_run(handler(monkeypatch, made), error="Error in rule solve:\n    log: logs/solve.log (check it)")
        text = re.sub(r"\r\x1b\[\?7l.*?\x1b\[\?7h", "", made.getvalue())
        assert "\nError in rule solve:\n    log: logs/solve.log (check it)\n" in text
        assert text.endswith("what became of it\nComplete log(s)\n")

    @cases
    def test_runs_that_ask_for_more_or_less_get_snakemakes_lines(self, monkeypatch, setting, value):
        made = io.StringIO()
        emit_run(handler(monkeypatch, made, **{setting: value}))
        assert made.getvalue().count("Select jobs to execute...") == 3


def test_what_is_left_follows_the_rate_so_far(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    display = Display({"a": 1, "b": 2, "total": 3}, io.StringIO(), True)
    display.over.set()
    display.record_event(LogEvent.JOB_INFO, 1, "a")
    now[0] += 60
    assert display.line() == "0 of 3 jobs, 1:00 min: a"
    display.record_event(LogEvent.JOB_FINISHED, 1, "")
    display.record_event(LogEvent.JOB_INFO, 2, "b")
    assert display.line() == "1 of 3 jobs, 1:00 min, about 2:00 min left: b"
    display.record_event(LogEvent.JOB_ERROR, 2, "")
    assert display.line() == "1 of 3 jobs, 1 failed, 1:00 min, about 2:00 min left"


def test_an_interrupt_is_one_line():
    code = (
        "import os, signal, snakemake_logger_plugin_springtune as ours\n"
        "signal.signal(signal.SIGINT, ours.end_quietly)\n"
        "os.kill(os.getpid(), signal.SIGINT)\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert ended.returncode and ended.stdout == ""
    assert ended.stderr == "stopped; what is computed is kept: the same command takes up where this one stopped\n"
