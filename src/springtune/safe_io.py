"""Files and texts from outside: read within bounds, written whole or not at all, shown without control characters."""

import csv
import errno
import json
import math
import mmap
import os
import platform
import re
import signal
import stat
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from html import escape
from pathlib import Path
from typing import Any, TypeVar

LARGEST_CSV = 5_000_000  # bytes of the largest CSV file that is read


_memory_lock = threading.RLock()  # lock: a memory limit applies to the whole process


class BeyondSize(ValueError):
    """A file is larger than the limit for reading."""


class DataElsewhere(ValueError):
    """A file has data in another file or behind a link."""


class BeyondBound(MemoryError):
    """Reading a file takes more memory or time than it may."""


def why_unreadable(path: str | Path) -> str:
    """Return why a file cannot be read, or an empty string; pipes and devices may block or never end."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError) as error:  # a ValueError is of a name that no file can have
        return getattr(error, "strerror", None) or str(error)
    if stat.S_ISDIR(mode):
        return os.strerror(errno.EISDIR)
    return "" if stat.S_ISREG(mode) else "a pipe or a device, not a file"


def read(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file; refuse one that is larger than `most` bytes."""
    if why := why_unreadable(path):
        raise ValueError(why)
    try:
        with open(path, "rb") as file:
            found = file.read(most + 1)
    except OSError as error:
        raise ValueError(error.strerror or str(error)) from None
    if len(found) > most:
        raise BeyondSize(f"larger than {most / 1e6:g} MB")
    return found


Rows = list[tuple[int, list[str]]]  # rows of a CSV file with their line numbers


DECIMAL = re.compile(r"[+-]?\d*[.,]\d*(?:[eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def csv_rows(path: str | Path, refuse: Callable[[str], ValueError], remedy: str) -> Rows:
    """Read the rows of a CSV file, head first, without # comments; also semicolons, tabs and decimal commas."""
    try:
        lines = read(path, LARGEST_CSV).decode("utf-8-sig").splitlines()
    except ValueError as error:
        why = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else error
        raise refuse(f"'{path}' cannot be read: {why}; {remedy}") from None
    texts = [(number, line) for number, line in enumerate(lines, 1) if line.strip(" \t,;") and line[0] != "#"]
    if not texts:
        raise refuse(f"'{path}' is empty; {remedy}")
    separator = next((sign for sign in ";\t" if sign in texts[0][1]), ",")
    rows: Rows = []
    for number, line in texts:
        try:
            rows += [(number, row) for row in csv.reader([line], delimiter=separator, skipinitialspace=True)]
        except csv.Error:
            most = csv.field_size_limit()
            raise refuse(f"'{path}', line {number}: a cell has over {most} characters; correct it") from None
    return rows[:1] + _with_points(path, rows[1:], refuse)


def _with_points(path: str | Path, rows: Rows, refuse: Callable[[str], ValueError]) -> Rows:
    """Replace decimal commas by points; refuse commas that may separate thousands."""
    found = [cell.strip() for _, row in rows for cell in row if DECIMAL.fullmatch(cell.strip())]
    commas = [cell for cell in found if "," in cell]
    if not commas:
        return rows
    point = next((cell for cell in found if "." in cell), "")
    if point:
        raise refuse(f"'{path}': {point!r} and {commas[0]!r} have different decimal signs; write decimal points")
    if all(map(THOUSANDS.fullmatch, commas)):
        one = commas[0]
        what = f"{one!r} is {one.replace(',', '.')} or {one.replace(',', '')}"
        raise refuse(f"'{path}': {what}; write a decimal point, or no comma")
    return [(number, [c.replace(",", ".") if DECIMAL.fullmatch(c.strip()) else c for c in row]) for number, row in rows]


def numbers(
    path: str | Path, rows: Rows, names: Sequence[str], refuse: Callable[[str], ValueError]
) -> list[list[float]]:
    """Read the numbers of rows; a column without a name may have NaN."""
    found = []
    for line, row in rows:
        if len(row) != len(names):
            commas = "decimal commas need ';' between columns" if len(row) == 2 * len(names) else "correct it"
            raise refuse(f"'{path}', line {line}: has {len(row)} values, and the head {len(names)}; {commas}")
        found.append([number_of(text) for text in row])
        for name, text, number in zip(names, row, found[-1]):
            if name and not math.isfinite(number):
                why = f"{text.strip()!r} is no finite number; correct the line, or remove it"
                raise refuse(f"'{path}', line {line}, column {name!r}: {why}")
    return found


def number_of(text: object) -> float:
    """Return the number of a text, or NaN."""
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return math.nan


def virtual_memory() -> int:
    """Return the bytes that this process has mapped; 0 if the system does not report it."""
    try:
        with open("/proc/self/statm", "rb", buffering=0) as file:
            return int(file.read().split()[0]) * mmap.PAGESIZE
    except OSError:
        return 0


@contextmanager
def bounded(memory: float, seconds: float = 0.0) -> Iterator[None]:
    """Context that limits additional memory [bytes] and processor time [s], this in the main thread alone."""
    with _memory_lock, _time_limit(seconds):
        used = virtual_memory()
        if not used:
            yield
            return
        import resource

        before = resource.getrlimit(resource.RLIMIT_AS)
        bound = used + int(memory)
        if any(limit != resource.RLIM_INFINITY and limit <= bound for limit in before):
            yield
            return
        resource.setrlimit(resource.RLIMIT_AS, (bound, before[1]))
        try:
            yield
        except BeyondBound:
            raise
        except MemoryError as error:
            raise BeyondBound(f"it takes more than {memory / 1e9:.3g} GB") from error
        finally:
            resource.setrlimit(resource.RLIMIT_AS, before)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Context that raises BeyondBound after some seconds of processor time."""
    if not seconds or threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise BeyondBound(f"it takes more than {seconds:g} s")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def check_alone(path: str | Path) -> None:
    """Refuse an HDF5 file with data that are in other files or behind links."""
    import h5py  # here: few commands read such files

    elsewhere: dict[str, str] = {}

    def look(name: str, link: object) -> None:
        if isinstance(link, h5py.SoftLink):
            elsewhere[name] = "a soft link"
        elif isinstance(link, h5py.ExternalLink):
            elsewhere[name] = "an external link"
        elif isinstance(array := file[name], h5py.Dataset) and array.external:
            elsewhere[name] = f"stored outside of the file, in {array.external[0][0]!r}"
        elif isinstance(array, h5py.Dataset) and array.is_virtual:
            elsewhere[name] = "a virtual dataset"

    try:
        with h5py.File(path) as file:
            file.visititems_links(look)
    except (LookupError, RuntimeError, SystemError, TypeError, ValueError) as error:
        raise OSError(f"damaged: {error}") from None
    for name, what in elsewhere.items():
        raise DataElsewhere(
            f"{path}: {name!r} is {what}; links and other files are not followed: write the array in its place"
        )


UNFINISHED_ENDING = ".unfinished"
"""Ending of the name of a file that is being written, after its own and who writes it, `writer`."""

ABANDONED_SECONDS = 3600.0
"""Seconds after which another machine's unfinished file counts as left over; writing takes seconds."""


def writer() -> str:
    """Process and machine for the name of an unfinished file: another machine may have the same process number."""
    return f"{os.getpid()}@{platform.node().replace('.', '-')}"


@contextmanager
def replacing(path: str | Path, synced: bool = False) -> Iterator[Path]:
    """Context that writes a file under another name and renames it when complete; after an error nothing changes."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.{writer()}{UNFINISHED_ENDING}")
    try:
        yield unfinished
        if synced:
            with open(unfinished, "rb+") as file:
                os.fsync(file.fileno())
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def check_folder(path: str | Path) -> None:
    """Refuse a file whose folder does not exist, rather than create a misspelled one."""
    folder = Path(path).parent
    if not folder.exists():
        raise ValueError(f"{path}: folder {folder} does not exist; make it first")


def remove_unfinished(folder: str | Path, below: bool = True) -> None:
    """Remove files in a folder that killed writers left; on other machines, those without a write for an hour."""
    for path in (Path(folder).rglob if below else Path(folder).glob)(f"*{UNFINISHED_ENDING}"):
        with suppress(FileNotFoundError):  # just finished, or another run was quicker
            if path.is_file() and not _is_being_written(path):
                path.unlink()


def reset_future_times(folder: str | Path) -> None:
    """Give files with a time in the future the present time; a clock that was set back leaves such files."""
    now = time.time()
    for path in Path(folder).rglob("*"):
        if path.is_file() and path.stat().st_mtime > now:
            os.utime(path)


def _is_being_written(path: Path) -> bool:
    """Return whether the process that writes an unfinished file runs, or may run."""
    number, _, host = path.name.removesuffix(UNFINISHED_ENDING).rpartition(".")[2].partition("@")
    if host not in ("", writer().partition("@")[2]):
        return time.time() < path.stat().st_mtime + ABANDONED_SECONDS
    import psutil  # here: hardly ever is there something to ask

    try:
        return psutil.Process(int(number)).status() != psutil.STATUS_ZOMBIE
    except (OverflowError, ValueError, psutil.NoSuchProcess):
        return False
    except psutil.AccessDenied:
        return True


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file atomically; create missing folders."""
    with replacing(path) as unfinished:
        unfinished.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write UTF-8 text atomically; create missing folders."""
    write_bytes(path, text.encode())


def write_json(path: str | Path, content: Any) -> None:
    """Write JSON atomically."""
    write_text(path, json.dumps(content, indent=1) + "\n")


UNSEEN_PATTERN = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufffe\uffff\ud800-\udfff]")
"""Control characters, line breaks, bidirectional marks, surrogates and what is no character in XML."""

PUNCTUATION = re.compile(r"([^\w\s]|_)")  # characters that a markup language may interpret


def shown(text: object) -> str:
    r"""Return a text as one line with its control characters escaped.

    >>> print(shown("12 faults\x1b[2K\r0 faults\n"))
    12 faults\x1b[2K\r0 faults\n
    """
    return UNSEEN_PATTERN.sub(lambda found: ascii(found[0])[1:-1], str(text))


def printable(text: object) -> str:
    r"""Return a text as one line of printable characters, for a generated program; others are escaped.

    >>> print(printable("steel\r\nimport os\u200b"))
    steel\r\nimport os\u200b
    """
    return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in str(text))


def json_line(text: str) -> str:
    r"""Return a line of JSON with unseen characters as JSON escapes them.

    >>> print(json_line('"one\u2028two"'))
    "one\u2028two"
    """
    return UNSEEN_PATTERN.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def xml_comment(text: str) -> str:
    """Return a text as one line for a comment of XML, which must not have two hyphens in a row.

    >>> print(xml_comment("x---><include/>"))
    x- - -><include/>
    """
    return re.sub("-(?=-)", "- ", printable(text))


def clipped(text: str, longest: int = 60) -> str:
    """Return a text as `shown`, shortened for a message."""
    return shown(text if len(text) <= longest else f"{text[: longest - 3]}...")


def rst(text: str) -> str:
    r"""Return a text escaped for reStructuredText.

    >>> print(rst("`click <javascript:alert(1)>`__"))
    \ \`click \<javascript\:alert\(1\)\>\`\_\_
    """
    # The escaped space is nothing; without it, a line of backslashes would be a transition.
    return r"\ " + PUNCTUATION.sub(r"\\\1", text.strip())


def no_mathematics(text: str) -> str:
    r"""Return a figure's text with its dollar signs escaped.

    >>> print(no_mathematics("$x_{"))
    \$x_{
    """
    return text.replace("$", r"\$")


def aligned(rows: Iterable[Iterable[object]], left: int, right: Collection[int] = ()) -> str:
    """Align columns, those in `right` to the right."""
    texts = [[shown(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts)]
    lines = []
    for row in texts:
        cells = [
            cell.rjust(width) if n in right else cell.ljust(width) for n, (cell, width) in enumerate(zip(row, widths))
        ]
        lines.append((" " * left + "  ".join(cells)).rstrip())
    return "\n".join(lines)


def number_text(number: float, unit: str) -> str:
    """Number with unit, lengths in mm; empty for NaN.

    >>> number_text(0.005, "m"), number_text(0.3, "1"), number_text(4e5, "N")
    ('5 mm', '0.3', '400000 N')
    """
    if number != number:
        return ""
    if unit == "m":
        return f"{1e3 * number:.6g} mm"
    return f"{number:.6g}" if unit in ("", "1") else f"{number:.6g} {unit}"


def mesh_size_text(size: float) -> str:
    """Mesh size [m] as options take it: ``3.08 mm``."""
    return f"{1e3 * size:.12g} mm"


def html_table(name: str, rows: Iterable[Sequence[object]], heads: Iterable[object] = ()) -> str:
    """HTML table below a name; the first cell of each row is its head."""
    lines = ["".join(_cell("th", head) for head in heads)]
    lines += [_cell("th", first) + "".join(_cell("td", cell) for cell in others) for first, *others in rows]
    table = "".join(f"<tr>{line}</tr>" for line in lines if line)
    return f"<div><b>{escape(name)}</b><table>{table}</table></div>"


WRAP_CHARACTERS = 30  # characters from which a cell may have several lines


def _cell(tag: str, content: object) -> str:
    text = shown(content)
    space = "normal" if len(text) >= WRAP_CHARACTERS else "nowrap"  # notebooks have styles of their own
    return f'<{tag} style="text-align: left; vertical-align: top; white-space: {space}">{escape(text)}</{tag}>'


class Tabled:
    """Object with rows of labels and texts: one line in `repr`, a table in `print` and in notebooks."""

    def _rows(self) -> Iterable[tuple[str, str]]:
        """Return labels and texts with units; rows with an empty text are hidden."""
        raise NotImplementedError

    def _computed_rows(self) -> Iterable[tuple[str, str]]:
        """Return rows that take time to compute; only tables show them."""
        return ()

    def _table(self) -> list[tuple[str, str]]:
        return [row for row in (*self._rows(), *self._computed_rows()) if row[1]]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({'; '.join(f'{label}: {text}' for label, text in self._rows() if text)})"

    def __str__(self) -> str:
        return f"{type(self).__name__}\n{aligned(self._table(), left=2)}"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._table())


One = TypeVar("One", bound=Tabled)


class TabledList(list[One]):
    """List whose objects are the rows of one table."""

    def table(self) -> list[list[str]]:
        """Return the labels, then the texts of each object."""
        rows = [dict(one._rows()) for one in self]
        labels = list(dict.fromkeys(label for row in rows for label in row))
        return [labels, *([row.get(label, "") for label in labels] for row in rows)]

    def __repr__(self) -> str:
        return aligned(self.table(), left=1)

    def _repr_html_(self) -> str:
        heads, *rows = self.table()
        return html_table(", ".join({type(one).__name__: None for one in self}) or "none", rows, heads)


def clock(seconds: float) -> str:
    """Duration as text, such as ``1:15 min``.

    >>> clock(3.4), clock(75), clock(7300)
    ('3 s', '1:15 min', '2:01 h')
    """
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    minutes, rest = divmod(seconds, 60)
    return f"{minutes}:{rest:02d} min" if minutes < 60 else f"{minutes // 60}:{minutes % 60:02d} h"
