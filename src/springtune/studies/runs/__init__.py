"""Runs of a study: the jobs of its stages, stored results by key, and records of what is done."""
