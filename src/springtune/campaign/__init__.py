"""A campaign: the plan of a study's jobs, its dataset, its figures and tables."""
