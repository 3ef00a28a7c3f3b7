"""A study's jobs, done in this process in the order of a run."""

from pathlib import Path

from springtune.campaign import browse, collect, due, present
from springtune.campaign.plan import plan
from springtune.jobs import run_tasks
from springtune.kinds import load_study
from springtune.kinds.scenes import plan as scenes


class Campaign:
    """A study of this folder, as it is to be run now."""

    def __init__(self, config, cores=1, chosen=None):
        for cache in (scenes.mesh_key, scenes.stem):  # a run is a process of its own, and files change
            cache.cache_clear()
        self.config, self.study = str(config), load_study(config)
        self.folder = Path("results") / self.study.name
        self.plan = plan(self.study, self.folder, cores)
        self.chosen = chosen
        self.jobs = due.jobs(self.study, self.plan, chosen)

    def due(self):
        """Names of the jobs that are to run, in order."""
        found = []
        for name, job in self.jobs.items():
            if due.fault(job, self.jobs) or self._before(name) & set(found):
                found.append(name)
        return found

    def _before(self, name):
        """Jobs that a job comes after."""
        if name not in self.plan.jobs:
            return {*self.plan.jobs} if name == due.COLLECT else {due.COLLECT}
        stage, label = self.plan.jobs[name].stage, self.plan.jobs[name].label
        others = self.plan.jobs.items()
        same = {other for other, job in others if job.stage.name in stage.same and job.label == label}
        return same | {other for other, job in others if job.stage.name in stage.every}

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
            self.plan.write()
        for name in names:
            self.do(name)
        return names

    def do(self, name):
        """A job, by the function that its rule calls."""
        job, dataset = self.jobs[name], str(self.folder / due.DATASET)
        if name in self.plan.jobs:
            self.do_stage(name)
        elif name == due.COLLECT:
            untold = due.untold(self.folder, self.chosen)
            collect.main(self.config, str(self.folder), dataset, str(job.record), job.digest, *untold)
        elif name == due.BROWSE:
            browse.main(dataset, job.products[0], str(job.record), job.digest, *due.linked(self.study))
        else:
            names = [one.name for one in due.output_jobs(self.study)[name]]
            present.main(dataset, str(self.folder), str(job.record), job.digest, *names)

    def do_stage(self, name):
        """A job of a stage."""
        run_tasks.main(str(self.plan.tasks(name)), str(self.jobs[name].record), self.jobs[name].digest)
