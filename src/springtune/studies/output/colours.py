"""Colours that figures and the page to browse share; without matplotlib, which the page does without."""

ERROR_COLOURS = (
    "#ffffe5", "#fff7bc", "#fee391", "#fec44f", "#fe9929", "#ec7014", "#cc4c02", "#993404", "#662506",
)  # fmt: skip
"""Colours of the size of an error, from small to large, on a logarithmic scale: ColorBrewer's YlOrBr."""

ERROR_RANGE = (0.1, 100.0)
"""Sizes of errors at the ends of the scale [%]."""
