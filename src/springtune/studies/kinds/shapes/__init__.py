"""Shapes: bodies of any outline under loads on named groups, their networks beside references and others' numbers."""
