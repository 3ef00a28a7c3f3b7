"""A definition, a load, a mesh type and a study kind for springtune."""
