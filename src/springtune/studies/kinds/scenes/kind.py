"""Scenes of the grids: a study's own sections say what they are, see `springtune.studies.config.sections`."""

from ...config.kind import Kind
from .outputs import OUTPUTS, stems
from .plan import STAGES, pieces, take

KIND = Kind(
    "scenes",
    # Scenes are a study's own: its part says only that it has some.
    expand=lambda config, declared: config.grids,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
    pieces=pieces,
    take=take,
    costs={
        "mesh": (4e-3, 2.5e-5),
        "linear": (5e-4, 1e-6),
        "nonlinear": (1.5e-3, 1e-5),
        "curve": (1.5e-3, 1e-5),
        "reference": (3e-2, 0.0),
        "interpolant": (0.0, 3e-2),
        "finite": (1.0, 0.0),
        # Definitions that search, on top of their scenes.
        "adjoint": (0.05, 2e-4),
        "annealed": (0.05, 1e-3),
        "evolved": (0.05, 1e-3),
    },
)
