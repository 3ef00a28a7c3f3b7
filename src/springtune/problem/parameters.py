"""Numbers of a scene that a study may sweep: dimensions of its dataset then."""

SWEPT = {
    "force": ("size of the force on the loaded side; the load says its direction", "N"),
    "thickness": ("thickness of the sheet", "m"),
    "young_modulus": ("Young's modulus", "Pa"),
    "poisson_ratio": ("Poisson's ratio", "1"),
    "stiffness_scale": ("factor on the stiffness that the definition gives", "1"),
}
"""Description and unit of each by its name in studies and datasets."""

PLANES = "stress", "strain"
"""Plane stress and plane strain: the quantity that is zero across a sheet."""

OF_BODIES = {
    "thickness": "beam_thickness",
    "young_modulus": "material_young_modulus",
    "poisson_ratio": "material_poisson_ratio",
}
"""Variable of a dataset that holds a parameter of beams or materials."""

MOST_SCENES = 1_000_000
"""Most scenes of a study, those that grids share counted in each, unless `MOST_SCENES_VARIABLE` says more."""

MOST_SCENES_VARIABLE = "SPRINGTUNE_MAX_SCENES"
"""Variable of the environment with another number."""


def shown_order(name: str, value: float) -> float:
    """Rank of a swept parameter's value: if only one can be shown, it is the last one present."""
    return -abs(value - 1) if name == "stiffness_scale" else value


def with_unit(name: str, value: float, digits: int = 4) -> str:
    r"""Return a swept parameter's value with its unit, without line breaks.

    >>> with_unit("force", 4e5), with_unit("thickness", 2e-3), with_unit("poisson_ratio", 0.3)
    ('400\xa0kN', 'thickness 2\xa0mm', 'nu\xa0=\xa00.3')
    """
    if name == "force":
        text = f"{value / 1e3:.{digits}g} kN" if abs(value) >= 1e3 else f"{value:.{digits}g} N"
    elif name == "thickness":
        return f"thickness {1e3 * value:.{digits}g}\u00a0mm"
    elif name == "young_modulus":
        text = f"E = {value / 1e9:.{digits}g} GPa" if value >= 1e9 else f"E = {value / 1e6:.{digits}g} MPa"
    elif name == "poisson_ratio":
        text = f"nu = {value:.{digits}g}"
    else:
        return f"stiffness times\u00a0{value:.{digits}g}"
    return text.replace(" ", "\u00a0")
