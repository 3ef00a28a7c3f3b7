"""Studies of `studies.yaml`, what their reader says, and their jobs, done in this process in the order of a run."""

import re
from pathlib import Path

import h5netcdf
import pytest

import springtune as st
from springtune.studies.kinds import collect
from springtune.studies.kinds.bodies.kind import mesh_key, stem
from springtune.studies.output import browse, present, reading
from springtune.studies.runs import attempts, job, keys, plan

TIMES = re.compile("seconds|created|history|git_")
"""Names of values that are others in every run or checkout."""

EVERY = {"sensitivity": ("reference",), "calibrate": ("sensitivity",), "solve": ("reference", "calibrate")}
"""Stages that a stage needs all jobs of, as the rules in ``workflow/rules/stages.smk`` have it."""


def load_text(folder, text, name="study.yaml"):
    """Load a study from its text, or its bytes."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return st.load_study(folder / name)


def refusal(folder, text, name="study.yaml"):
    """Message that the text of a study gets, without the folder."""
    with pytest.raises(st.StudyError) as caught:
        load_text(folder, text, name)
    return str(caught.value).replace(f"{folder}/", "")


def do_stages(study, folder, *stages):
    """Run the jobs of a study, or of some of its stages, and assert that no task is broken."""
    for one in plan.stage_jobs(study, folder).values():
        if not stages or one.stage.name in stages:
            attempts.do_tasks(one.stage.module, one.content)


def held(path):
    """What a dataset holds, without times: attributes, and values and dimensions of variables, by group."""
    found = {}
    with h5netcdf.File(path) as file:
        for group in (file, *file.groups.values()):
            held = found[group.name] = {name: str(one) for name, one in group.attrs.items() if not TIMES.search(name)}
            for name, stored in group.variables.items():
                if not TIMES.search(name):
                    values = stored[...]
                    held[name] = stored.dimensions, values.tolist() if values.dtype == object else values.tobytes()
    return found


class Campaign:
    """A study of this folder, as it is to be run now."""

    do_tasks = staticmethod(attempts.do_tasks)  # without a worker, which would import and compile all anew

    def __init__(self, config):
        for cache in (mesh_key, stem):  # a run is a process of its own, and files change
            cache.cache_clear()
        self.config, self.study = str(config), st.load_study(config)
        self.folder = Path("results") / self.study.name
        self.jobs = plan.jobs(self.study, self.folder)
        self.bundles = {name: job for name, job in self.jobs.items() if job.stage}

    def due(self):
        """Names of the jobs that are to run, in order."""
        found = []
        for name, one in self.jobs.items():
            if plan.rerun_reason(one) or self.before(name) & set(found):
                found.append(name)
        return found

    def before(self, name):
        """Jobs that a job comes after."""
        if name not in self.bundles:
            return {*self.bundles} if name == plan.COLLECT else {plan.COLLECT}
        stage, label = self.bundles[name].stage, self.bundles[name].label
        others = self.bundles.items()
        same = {other for other, job in others if job.stage.name == stage.like and job.label == label}
        return same | {other for other, job in others if job.stage.name in EVERY.get(stage.name, ())}

    def finish(self, last=None):
        """Run what is to run, as far as a job.

        Returns
        -------
        list of str
            Names of the jobs that ran.
        """
        names = self.due()
        if last is not None:
            names = names[: names.index(last) + 1] if last in names else []
        if names:
            self.write()
        for name in names:
            self.do(name)
        return names

    def collected(self):
        """The dataset, when all that it is made of has run."""
        self.finish(plan.COLLECT)
        return reading.open(self.folder)

    def do(self, name):
        """A job, by the function that its rule calls."""
        one, dataset = self.jobs[name], str(self.folder / plan.DATASET)
        if name in self.bundles:
            self.do_stage(name)
        elif name == plan.COLLECT:
            collect.main(self.config, str(self.folder), dataset, str(one.record), one.digest)
        elif name == plan.BROWSE:
            browse.main(dataset, one.products[0], str(one.record), one.digest, *plan.linked_files(self.study))
        else:
            names = [one.name for one in plan.output_jobs(self.study)[name]]
            present.main(dataset, str(self.folder), str(one.record), one.digest, *names)

    def do_stage(self, name):
        """A job of a stage."""
        one = self.jobs[name]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(job, "do_in_worker", self.do_tasks)
            job.main(str(one.tasks), str(one.record), one.digest, self.config)

    def write(self):
        """Write the tasks of all jobs, as the begin of a run does."""
        for one in self.bundles.values():
            one.write()


def forget_keys():
    """Forget keys; of the same code, versions may be others."""
    for name in "stage_key code_key version_of distribution file_digest package_digests".split():
        getattr(keys, name).cache_clear()
