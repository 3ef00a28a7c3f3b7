"""Problems: bodies, materials, loads and their boundary conditions, and the comparison of answers."""
