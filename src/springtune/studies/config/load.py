"""Load a study from YAML: validate it, expand it, remove duplicates and sort."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from springtune.registry import NAME, NAME_RULE

from .checks import check_counts, check_definitions, check_meshes, check_names
from .combinations import with_rows
from .expand import build, expand, files_of_meshes, files_of_tests
from .kind import Kind
from .messages import Key, Problems, StudyError, read_study, read_yaml, show
from .model import Study
from .sections import StudyConfig, study_model


def load(path: str | Path, kinds: Sequence[Kind], beside: Path | None = None) -> Study:
    """Read, validate and expand a study."""
    path, file = Path(path), str(path)
    beside = beside or path.parent
    text, content, lines = read_study(path)
    if not NAME.fullmatch(path.stem):
        raise StudyError(f"{file}: '{path.stem}' cannot name a study; rename the file: {NAME_RULE}")
    problems = Problems(file, lines, beside)
    content = with_rows(content, beside, problems)
    config = _validate(study_model(kinds, content if isinstance(content, dict) else ()), content, problems)
    check_names(config, problems)
    check_counts(config, content, problems)
    for kind in filter(lambda kind: kind.wanted(config), kinds):
        kind.check(config, problems)
    problems.stop()
    test_files = files_of_tests(config, beside, problems)
    mesh_files = files_of_meshes(config, beside, problems)
    grids = expand(config, mesh_files, problems)
    check_meshes(config, content, grids, problems)
    problems.stop()
    check_definitions(config, content, grids, problems)
    problems.stop()
    printed_path = beside / config.printed if config.printed else None
    about = {"name": path.stem, "path": path, "text": text, "printed_path": printed_path, "mesh_files": mesh_files}
    about["row_files"] = tuple(beside / grid.rows for grid in config.grids.values() if grid.rows)
    about["test_files"] = test_files
    return build(config, grids, kinds, problems, about)


def _validate(model: type[StudyConfig], content: Any, problems: Problems) -> StudyConfig:
    if content is None:
        problems.stop_at((), f"the file is empty; give the keys {', '.join(model.model_fields)}")
    try:
        return model.model_validate(content)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            path: list[Key] = []
            place = content
            # pydantic's path has steps that the file has not: branches of a union, the item of a single value.
            for step in details["loc"]:
                if step in place if isinstance(place, dict) else isinstance(place, list) and isinstance(step, int):
                    path.append(step)
                    place = place[step]
            own = details["type"] == "study"
            path += [step for step in details["ctx"]["path"] if isinstance(place, list | dict)] if own else []
            message = details["msg"] if own else f"{show(place)}: {details['msg']}; see config/README.md"
            if details["type"] == "dict_type":
                message = f"{show(place)} instead of names and their values, such as {{name: value}}; give a mapping"
            problems.add(path, message)
        problems.stop()
        raise


def named_files(text: str, path: Path) -> list[Path]:
    """Files that a study names under any key."""
    content, _ = read_yaml(text, str(path))
    found = {value for value in _texts(content) if value.strip() and len(value) < 255}
    files = (path.parent / value for value in sorted(found))
    return [file.resolve() for file in files if file.is_file()]


def _texts(content: Any) -> Iterator[str]:
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for value in content.values() if isinstance(content, dict) else content:
            yield from _texts(value)
