"""Studies: from a config file to a dataset, its figures and tables, a page, an archive and a paper."""
