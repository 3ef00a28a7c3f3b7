"""Load a study from YAML: validate it, expand it, remove duplicates and sort."""

from pathlib import Path
from typing import Any

from springtune.registry import NAME, NAME_RULE

from .checks import check_definitions, check_meshes, check_names, check_scenes
from .combinations import add_rows
from .expand import build, declared, expand, files_of_meshes
from .fields import FILES
from .kind import Kind
from .messages import Problems, StudyError, read_study, validated
from .model import Study
from .sections import study_model


def load(path: str | Path, kinds: tuple[Kind, ...]) -> Study:
    """Read, validate and expand a study."""
    path, file = Path(path), str(path)
    text, content, lines = read_study(path)
    if not NAME.fullmatch(path.stem):
        raise StudyError(f"{file}: '{path.stem}' cannot name a study; rename the file: {NAME_RULE}")
    problems = Problems(file, lines, content, path.parent)
    model = study_model(kinds)
    if content is None:
        problems.stop_at((), f"the file is empty; give the keys {', '.join(model.model_fields)}")
    files: list[str] = []
    add_rows(content, problems, files)
    # Names that sections refer to; of a section that is no mapping, whose error is enough, nothing is known.
    given = content.items() if isinstance(content, dict) else ()
    sections: dict[str, Any] = {key: one if isinstance(one, dict) else None for key, one in given} | {FILES: files}
    config = validated(model, content, problems, context=sections)
    check_names(config, problems)
    problems.stop()
    check_scenes(config, problems)
    problems.stop()
    for kind in filter(lambda kind: kind.wanted(config), kinds):
        kind.check(config, problems)
    problems.stop()
    bodies = declared(config, problems)
    mesh_files = files_of_meshes(config, bodies.beams, problems)
    grids = expand(config, bodies, mesh_files, problems)
    check_meshes(config, grids, problems)
    problems.stop()
    check_definitions(config, grids, problems)
    problems.stop()
    printed_path = path.parent / config.printed if config.printed else None
    about = {"name": path.stem, "path": path, "text": text, "printed_path": printed_path, "mesh_files": mesh_files}
    about["files"] = tuple(path.parent / name for name in files)
    return build(config, bodies, grids, kinds, problems, about)
