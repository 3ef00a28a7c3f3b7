"""A result depends on its own key alone: not on what is computed along with it, before it, or was stored already."""

import copy
import random

import h5py
import pytest

import springtune as st
from springtune.studies.runs import attempts, store
from springtune.studies.runs.plan import plan

from tables import STUDIES

STUDY = STUDIES["company"]

TIMES = ("seconds",)
"""Ends of the names of what is another one in every run."""


def stages(study, folder):
    """Modules of the jobs of a study and what they are to do, in an order in which they can run."""
    return [(one.stage.module, one.content) for one in plan(study, folder).values()]


def compute(module, content):
    """Do a job."""
    attempts.do_tasks(module, content)


def keys(content):
    """Keys of the tasks of a job."""
    found = [one["key"] for one in lists(content) if "key" in one]
    return found + [key for one in lists(content) if "key" not in one for key in keys(one)]


def lists(content):
    """Dicts in lists of a dict: tasks, or what tasks have in common."""
    return [one for value in content.values() if isinstance(value, list) for one in value if isinstance(one, dict)]


def only(content, wanted):
    """The job with the tasks of these keys alone."""
    left = dict(content)
    for name, value in content.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            left[name] = [only(one, wanted) for one in value if {one.get("key"), *keys(one)} & wanted]
    return left


def shuffled(content, generator):
    """The job with its tasks in another order."""
    content = copy.deepcopy(content)
    for value in content.values():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            generator.shuffle(value)
            value[:] = [shuffled(one, generator) for one in value]
    return content


def results(folder):
    """What is stored, by file and key: scalars, texts and the bytes of arrays, without times."""
    found = {}
    for path in sorted(folder.rglob("*.h5")):
        for key, result in store.read(path, store.stored_keys(path)).items():
            found[path.parent.relative_to(folder).name, path.stem, key] = {
                name: repr(without_times(value)) for name, value in result.items() if not name.endswith(TIMES)
            }
        with h5py.File(path) as file:
            for key in set(file) - {store.SCALARS}:
                of_key = found[path.parent.relative_to(folder).name, path.stem, key]
                of_key |= {name: (array.shape, array[()].tobytes()) for name, array in file[key].items()}
    return found


def without_times(value):
    """Value of a result; of rows without what is another one in every run."""
    if not isinstance(value, list):
        return value
    return [{name: one for name, one in row.items() if not name.endswith(TIMES)} for row in value]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("company") / "many.yaml"
    path.write_text(STUDY)
    return st.load_study(path)


@pytest.fixture(scope="module")
def usual(study, tmp_path_factory):
    """Results of the study as it is usually run."""
    folder = tmp_path_factory.mktemp("usual")
    for module, content in stages(study, folder):
        compute(module, content)
    found = results(folder)
    solved = [one for (folder, *_), one in found.items() if folder == "solutions" and "status" in one]
    assert {one["status"] for one in solved} >= {"1", "4"} and len(solved) == 148
    return found


def same(found, wanted):
    """Fails with what differs."""
    differing = [(key, name) for key in wanted for name in wanted[key] if found[key].get(name) != wanted[key][name]]
    assert not differing and found.keys() == wanted.keys(), f"{len(differing)}: {differing[:10]}"


def test_what_was_stored_before_does_not_matter(study, usual, tmp_path):
    """A random half of the tasks of each job first; then a few at a time; then all that is left."""
    generator = random.Random(0)
    for module, content in stages(study, tmp_path):
        every = sorted(set(keys(content)))
        generator.shuffle(every)
        if not module.endswith("calibrate"):  # one result of all curves
            for part in (every[: len(every) // 2], every[-3:]):
                compute(module, only(content, set(part)))
        compute(module, content)
    same(results(tmp_path), usual)
