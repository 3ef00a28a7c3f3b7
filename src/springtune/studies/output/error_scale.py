"""How figures and the page to browse show errors: colours of their size, meaning of their sign. By numpy alone."""

from collections.abc import Mapping, Sequence

import numpy as np

from springtune.problem.compare import sign_sentence

ERROR_COLOURS = (
    "#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506",
)  # fmt: skip
"""Colours of the size of an error, from small to large, on a logarithmic scale: ColorBrewer's YlOrBr."""

ERROR_RANGE = (0.1, 100.0)
"""Sizes of errors at the ends of the scale [%]."""


def sign_of_displacements(references: np.ndarray, axes: Mapping[str, Sequence[object]]) -> str:
    """Sentence on which sign of errors means too soft, by loads or else quantities; empty without any reference."""
    signs = np.sign(references)
    known = signs[np.isfinite(signs) & (signs != 0)]
    if not known.size or (known == known[0]).all():
        return sign_sentence({"": known[0]}) if known.size else ""
    for name, where in (("load", "under"), ("quantity", "of")):
        if name in axes:
            others = tuple(axis for axis, other in enumerate(axes) if other != name)
            low, high = np.fmin.reduce(signs, axis=others), np.fmax.reduce(signs, axis=others)
            if not ((low < 0) & (high > 0)).any():
                return sign_sentence({str(label): sign for label, sign in zip(axes[name], low + high)}, where)
    return "too soft: errors with the sign of their reference"
