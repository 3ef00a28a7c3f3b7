"""Files and texts from outside: read within bounds, written whole or not at all, shown without control characters."""
