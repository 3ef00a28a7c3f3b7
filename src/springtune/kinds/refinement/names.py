"""Parameters that a refinement may vary: what each is, and how its values are read and shown."""

from dataclasses import dataclass

from ...units import UnitError, parse


@dataclass(frozen=True)
class Parameter:
    """A parameter of a scene.

    Attributes
    ----------
    meaning : str
    unit : str
        In SI.
    kind : str
        Of `springtune.units.QUANTITY_KINDS`; empty for numbers.
    shown, times : str, float
        Unit in figures and tables, and how many of them make one in SI.
    most : float
        Largest value.
    zero : bool
        Whether it may be zero.
    """

    meaning: str
    unit: str
    kind: str = ""
    shown: str = ""
    times: float = 1.0
    most: float = float("inf")
    zero: bool = False

    def read(self, text: str) -> float:
        """Value of a text.

        Parameters
        ----------
        text : str

        Returns
        -------
        float
            In SI units.

        Raises
        ------
        ValueError
            If it is none; the message says why and what to give.
        """
        if self.kind:
            try:
                value = parse(text, self.kind)
            except UnitError as error:
                raise ValueError(str(error)) from None
        else:
            try:
                value = float(text)
            except ValueError:
                raise ValueError(f"'{text}' is not a number; give one such as 0.3") from None
        if not (value >= 0 if self.zero else value > 0) or not value <= self.most or value == float("inf"):
            most = f" to {self.most:g}" if self.most < float("inf") else ""
            raise ValueError(f"'{text}' is out of range; give a value {'from' if self.zero else 'above'} 0{most}")
        return value


PARAMETERS = {
    "mesh_size": Parameter("asked length of an edge", "m", "length", "mm", 1e3),
    "force": Parameter("size of the force", "N", "force", "kN", 1e-3),
    "thickness": Parameter("thickness of the sheet", "m", "length", "mm", 1e3),
    "young_modulus": Parameter("Young's modulus", "Pa", "stress", "MPa", 1e-6),
    "poisson_ratio": Parameter("Poisson's ratio", "1", most=0.5, zero=True),
    "stiffness_scale": Parameter("factor on the stiffness that the definition gives", "1"),
}
"""Parameters by name."""

SPACINGS = ("linear", "logarithmic")
"""How values are spaced."""
