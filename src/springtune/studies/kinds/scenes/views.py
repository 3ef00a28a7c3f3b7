"""What the page to browse shows of scenes, curves and references."""

from ...output.browse import Plot, View

VIEWS = (
    View(
        "/",
        "Cells",
        "All variables of the cells, over any of their parameters.",
        (
            Plot("errors of definitions on mesh types", "deformation_error", "mesh_type", "definition", "map"),
            Plot("errors of definitions under loads", "deformation_error", "load", "definition", "map"),
            Plot("error over mesh size", "deformation_error", "mesh_size", "definition", log="xy"),
            Plot("error of the whole field over mesh size", "field_error", "mesh_size", "definition", log="xy"),
            Plot("seconds over particles", "solve_seconds", "particles", "definition", along="mesh_size", log="xy"),
            Plot("what became of the cells", "status", "mesh_size", "definition", "map"),
        ),
        (
            "deformation_error",
            "status",
            "displacement",
            "reference_displacement",
            "field_error",
            "stiffness",
            "paper_deformation_error",
            "paper_displacement",
            "particles",
            "solve_seconds",
            "residual",
            "message",
            "reference_message",
            "paper_remark",
        ),
    ),
    View(
        "/sensitivity",
        "Curves",
        "Sensitivity curves: error and displacement against one stiffness of all springs.",
        (
            Plot("error over stiffness", "deformation_error", "stiffness", "mesh_size", along="stiffness_ratio"),
            Plot("displacement over stiffness", "displacement", "stiffness", "mesh_size", along="stiffness_ratio"),
            Plot("error over stiffness, meshes of a type", "deformation_error", "stiffness_ratio", "mesh_type"),
            Plot("best stiffness over mesh size", "best_stiffness", "mesh_size", "beam", log="x"),
            Plot("predicted stiffness over mesh size", "predicted_stiffness", "mesh_size", "beam", log="x"),
        ),
    ),
    View(
        "/finite_strain",
        "Finite strain",
        "References at finite strain, and the errors of the networks against them.",
        (
            Plot("error against finite strain", "deformation_error", "mesh_size", "definition"),
            Plot("errors of definitions under loads", "deformation_error", "load", "definition", "map"),
            Plot("displacement of the references", "reference_displacement", "load", "reference"),
        ),
    ),
    View(
        "/block",
        "Block",
        "Bodies under pressure: displacements over the loaded face, and the error in its middle.",
        (
            Plot(
                "displacement over the face",
                "face_profile",
                "face_position",
                "definition",
                beside=(("face_position", "reference_face_profile", "reference"),),
            ),
            Plot("error of the middle", "face_error", "mesh_size", "definition"),
            Plot("errors of the middle by definition and load", "face_error", "load", "definition", "map"),
            Plot("references over the face", "reference_face_profile", "face_position", "reference"),
        ),
    ),
    View(
        "/fields",
        "Fields",
        "Positions and displacements of all particles of the coarsest meshes; the view of cells draws the networks.",
        (
            Plot(
                "places of the particles at rest", "y", "x", shows="points", along="particle", equal=True,
                beside=(("outline_x", "outline_y", "outline of the reference"),),
            ),
            Plot("displacements along x", "displacement_x", "x", "definition", "points", "particle"),
            Plot("displacements along y", "displacement_y", "x", "definition", "points", "particle"),
            Plot("displacements of the outline", "reference_displacement_x", "outline_x", along="outline_point"),
        ),
    ),
)  # fmt: skip
