"""A result depends on its own key alone: not on what is computed along with it, before it, or was stored already."""

import random

import pytest

from springtune.studies.kinds import collect, load_study
from springtune.studies.runs import attempts
from springtune.studies.runs.plan import stage_jobs

from campaigns import do_stages, held
from tables import STUDIES


def lists(content):
    """Dicts in lists of a dict: tasks, or what tasks have in common."""
    return [one for value in content.values() if isinstance(value, list) for one in value if isinstance(one, dict)]


def keys(content):
    """Keys of the tasks of a job."""
    return {key for one in lists(content) for key in ([one["key"]] if "key" in one else keys(one))}


def only(content, wanted):
    """The job with the tasks of these keys alone."""
    left = dict(content)
    for name, value in content.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            left[name] = [only(one, wanted) for one in value if {one.get("key"), *keys(one)} & wanted]
    return left


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("company") / "many.yaml"
    path.write_text(STUDIES["company"])
    return load_study(path)


def test_what_was_stored_before_does_not_matter(study, tmp_path):
    """A random half of the tasks of each job first; then a few at a time; then all that is left."""
    generator = random.Random(0)
    do_stages(study, tmp_path / "usual")
    for job in stage_jobs(study, tmp_path / "parts").values():
        every = sorted(keys(job.content))
        generator.shuffle(every)
        if not job.stage.module.endswith("calibrate"):  # one result of all curves
            for part in (every[: len(every) // 2], every[-3:]):
                attempts.do_tasks(job.stage.module, only(job.content, {*part}))
        attempts.do_tasks(job.stage.module, job.content)
    usual, found = (
        collect.run(study, tmp_path / name, tmp_path / f"{name}.nc") or held(tmp_path / f"{name}.nc")
        for name in ("usual", "parts")
    )
    assert {1, 4} <= {*usual["/"]["status"][1]} and found == usual
