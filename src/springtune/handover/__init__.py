"""Springs for other programs: a network written out as plain arrays with units, and its files."""
