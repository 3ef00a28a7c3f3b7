"""Messages on a file that name line, key, value and remedy."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from pydantic_core import PydanticCustomError

from springtune.safe_io.escapes import UNSEEN, shown

Key = str | int
"""Step of a path into a file: a key or a list index."""

LONGEST_SHOWN = 60

SHOWN_PROBLEMS = 5
"""Problems that one message lists; the rest are counted."""


class StudyError(ValueError):
    r"""A study that cannot be run; the message names file, line, key, value and remedy.

    Parameters
    ----------
    *lines : str
        Lines of the message; control characters in them are shown as ``\x1b``.

    Examples
    --------
    >>> import springtune as st
    >>> try:
    ...     st.load_study("config/papers.yaml")
    ... except st.StudyError as error:
    ...     print(error)
    config/papers.yaml: cannot be read: No such file or directory; give the path of a study such as config/paper.yaml
    """

    def __init__(self, *lines: str) -> None:
        super().__init__(*map(shown, lines))

    def __str__(self) -> str:
        return "\n".join(self.args)


class Problems:
    """Collect problems of a file and raise them as one `StudyError`.

    Examples
    --------
    >>> problems = Problems("study.yaml", {("beams",): 3})
    >>> problems.add(("beams", "small"), "no length; give one such as '200 mm'")
    >>> problems.stop()
    Traceback (most recent call last):
    ...
    springtune.studies.config.messages.StudyError: study.yaml:3: beams.small: no length; give one such as '200 mm'
    """

    def __init__(self, file: str, lines: Mapping[tuple[Key, ...], int] | None = None, folder: Path = Path()) -> None:
        self._file, self._lines, self.folder = file, lines or {}, folder
        self._places: dict[tuple[Key, ...], str] = {}
        self._found: list[tuple[int, str]] = []

    def add(self, path: Iterable[Key], message: str, line: int = 0) -> None:
        """Add a problem."""
        path = tuple(path)
        # A missing key has no line, so the line of its section is used.
        above = (path[:size] for size in range(len(path), 0, -1))
        line = line or next((self._lines[keys] for keys in above if keys in self._lines), 0)
        place = self._places.get(path) or (f"{self._file}:{line}" if line else self._file)
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{clipped(key)}" for key in path).removeprefix(".")
        self._found.append((line, f"{place}: {keys}: {message}" if keys else f"{place}: {message}"))

    def located(self, path: tuple[Key, ...], place: str) -> None:
        """Set the place of a value that comes from another file."""
        self._places[path] = place

    @property
    def nothing(self) -> bool:
        """Return whether no problem was added."""
        return not self._found

    def stop(self) -> None:
        """Raise if a problem was added."""
        if not self._found:
            return
        messages = list(dict.fromkeys(message for _, message in sorted(self._found, key=lambda found: found[0])))
        more = len(messages) - SHOWN_PROBLEMS
        messages[SHOWN_PROBLEMS:] = [f"... and {more} more"] if more > 0 else []
        raise StudyError(*messages)


def refuse(message: str, *path: Key) -> PydanticCustomError:
    """Create the error of a validator."""
    return PydanticCustomError("study", "{message}", {"message": message, "path": path})


def show(value: object) -> str:
    """Format a value for a message.

    Examples
    --------
    >>> show("200 mm"), show([]), show({"length": "1 m"})
    ("'200 mm'", 'an empty list', 'a mapping')
    """
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if value is None:
        return "nothing"
    return f"'{clipped(str(value))}'"


def clipped(text: str) -> str:
    """Shorten a text for a message."""
    return shown(text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}...")


def unseen(text: str) -> str:
    """Return why a text is not one line of visible characters, or an empty string."""
    found = UNSEEN.search(text)
    return f"{show(text)} has '{shown(found[0])}'; write one line of characters that can be seen" if found else ""
