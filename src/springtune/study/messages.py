"""What is wrong with a file: messages that name file, line, key, value and remedy."""

from difflib import get_close_matches

from pydantic_core import PydanticCustomError

SHOWN_PROBLEMS = 5
"""Problems that one message lists; it counts the others."""


class StudyError(ValueError):
    """A study that cannot be run; the message names file, line, key, value and remedy."""


class Problems:
    """Collects what is wrong with a file and raises it as one `StudyError`.

    Parameters
    ----------
    file : str
        The file as its user named it.
    lines : dict of tuple to int, optional
        Line of each path of keys.
    """

    def __init__(self, file, lines=None):
        self._file, self._lines, self._found = file, lines or {}, []

    def add(self, path, message, line=0):
        path = tuple(path)
        # What is missing has no line of its own; that of what should hold it helps.
        above = (path[:size] for size in range(len(path), 0, -1))
        line = line or next((self._lines[keys] for keys in above if keys in self._lines), 0)
        place = f"{self._file}:{line}" if line else self._file
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")
        self._found.append((line, f"{place}: {keys}: {message}" if keys else f"{place}: {message}"))

    def stop(self):
        """Raise if anything was found."""
        if not self._found:
            return
        messages = list(dict.fromkeys(message for _, message in sorted(self._found, key=lambda found: found[0])))
        more = len(messages) - SHOWN_PROBLEMS
        messages[SHOWN_PROBLEMS:] = [f"... and {more} more"] if more > 0 else []
        raise StudyError("\n".join(messages))


def refuse(message, *path):
    """Error of a validator; `path` leads from the validated value to the culprit inside it."""
    return PydanticCustomError("study", "{message}", {"message": message, "path": path})


def show(value):
    """A value of the file, for a message."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if value is None:
        return "nothing"
    return f"'{value}'" if len(value) <= 60 else f"'{value[:57]}...'"


def nearest(word, words):
    """``did you mean ...? `` if one of the words is near, and all of them."""
    words = list(words)
    near = get_close_matches(word, words, n=1, cutoff=0.6)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return f"{hint}known: {', '.join(words)}"
