"""A definition, a load, a mesh type and an engine for springtune."""
