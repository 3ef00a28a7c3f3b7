"""What laying a strip costs."""


def cost_units(mesh_size: float) -> float:
    """What the cost of laying a strip on a mesh of some size [m] is in proportion to."""
    return (1e-3 / mesh_size) ** 3
