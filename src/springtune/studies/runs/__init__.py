"""Runs of a study: its plan, tasks, stored results and their keys, records, limits and locks."""
