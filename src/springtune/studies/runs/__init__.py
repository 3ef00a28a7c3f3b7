"""Runs of a study: the jobs of its stages, stored results by key, and records of what is done.

`plan` bundles tasks into jobs, `rerun` finds those that are due, and `job` does one in a process of its own: `attempts`
solves its tasks, `store` keeps their results under keys of `keys`. `locks` keeps runs apart; `source` and `provenance`
say which code and files a result comes from.
"""
