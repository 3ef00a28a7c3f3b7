"""One law for all springs of a lattice, fitted to a uniaxial test of rubber: springs alone.

On a lattice of equilateral triangles pulled along a row the oblique springs keep their length, and only the row's
springs carry. So `SpringLaw` is the test's law, up to a stretch of 2, at which the lattice lies flat. The remaining
error does not depend on the law: in equibiaxial tension all three directions carry, 1.5 times the uniaxial stress,
where an incompressible sheet has 2 times at small and up to 1 times at large stretches.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..problem.materials import CHECKED_STRETCHES, TensileTest, TestDataError, fit, read_test
from ..problem.quantities import whole_number

LAW_POWERS = (2, 5, 8)
"""Powers p of the terms s - s^-p of a spring's law, s its stretch: of a row of rubber, and of what is softer sooner."""

FLAT_STRETCH = 2.0  # stretch at which a lattice of equilateral triangles, pulled along a row, lies flat


@dataclass(frozen=True)
class SpringLaw:
    """One law for all springs of an equilateral lattice, and its response in the three tests.

    A spring of stretch s pulls with ``sum_p a_p (s - s^-p)`` per cross-section of its rows, p of `LAW_POWERS`, with the
    `coefficients` a_p [Pa]; `largest` is the largest stretch in the fitted data [1], below `FLAT_STRETCH`.
    """

    coefficients: tuple[float, ...]
    largest: float = np.inf

    @classmethod
    def fitted(cls, test: TensileTest | str | Path, terms: int = 3) -> "SpringLaw":
        """Law fitted to a uniaxial test along a row, as far as the lattice does not lie flat."""
        test = read_test(test)
        whole_number(terms, "terms", len(LAW_POWERS))
        below = test.stretch < FLAT_STRETCH
        if below.sum() <= terms:
            why = f"{terms} terms need more than {below.sum()} points below a stretch of {FLAT_STRETCH:g}"
            raise TestDataError(f"{test.name}: {why}, where the lattice lies flat; give fewer terms")
        test = TensileTest(test.stretch[below], test.stress[below], test.name)
        q = test.stretch
        columns = np.stack([q - q**-power for power in LAW_POWERS[:terms]], axis=1)
        law = cls(fit(columns, test), float(q.max()))
        if not (np.diff(law.pull(np.linspace(1, q.max(), CHECKED_STRETCHES))) > 0).all():
            raise TestDataError(f"{test.name}: the law of {terms} terms is unstable; give another number of terms")
        return law

    def pull(self, stretch: np.ndarray | float) -> np.ndarray:
        """Pull of a spring at its stretch [1], over the cross-section of its rows [Pa]."""
        s = np.asarray(stretch, float)
        return np.asarray(sum(a * (s - s ** -float(power)) for a, power in zip(self.coefficients, LAW_POWERS)))

    def stress(self, test: str, stretch: np.ndarray | float) -> np.ndarray:
        """Nominal stress [Pa] along a row, at stretches [1] of a test; NaN where the lattice lies flat."""
        q = np.asarray(stretch, float)
        row, oblique = self.pull(q), np.sqrt((q**2 + 3) / 4)
        if test == "uniaxial":  # the oblique springs carry nothing
            return np.where(q < FLAT_STRETCH, row, np.nan)
        return row * 1.5 if test == "equibiaxial" else row + q * self.pull(oblique) / (2 * oblique)
