"""Pages as a reader follows them: blocks are run in their order, and what they print is what the page shows."""

import doctest
import io
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path
from typing import NamedTuple

import yaml
from click.testing import CliRunner

import springtune as st
from springtune.cli import main

REPOSITORY = Path(__file__).parents[2]
COMMANDS = ("make", "snakemake", "springtune", "python", "cp", ".", "cd", "paraview")
"""What pages tell readers to type."""


class Block(NamedTuple):
    """A fenced block, and what a block of text after it shows; None where there is none."""

    language: str
    code: str
    shown: str | None


def blocks(page):
    """Fenced blocks of a page, in their order."""
    found = re.findall(r"^```(\w+)\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
    for (language, code), after in zip(found, [*found[1:], ("", "")]):
        if language != "text":
            yield Block(language, code, after[1] if after[0] == "text" else None)


def typed(page):
    """Commands of a page: in blocks for a shell, and in lines that are indented as such."""
    text = page.read_text()
    lines = "".join(re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE)).splitlines()
    outside = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    lines += re.findall(rf"^    ((?:{'|'.join(map(re.escape, COMMANDS))}) .*)$", outside, re.MULTILINE)
    return [shlex.split(line, comments=True) for line in lines if line.strip()]


def check_command(words, folder):
    """Assert that a command is one: its name, its options, and the files that it reads in a folder."""
    from snakemake.cli import parse_args

    name, *arguments = words
    assert name in COMMANDS, words
    if name == "make":
        targets = re.findall(r"^([\w-]+):", (REPOSITORY / "Makefile").read_text(), re.MULTILINE)
        assert all(word in targets or word.startswith("STUDY=") for word in arguments), words
        arguments = ["--configfile", *(word.removeprefix("STUDY=") for word in arguments if "=" in word)]
    if name in ("make", "snakemake"):
        _, options = parse_args(arguments if len(arguments) > 1 else [])
        for study in options.configfile or []:
            st.load_study(folder / study)
    elif name == "python":
        written = arguments[0].endswith(".newton.py")  # by the command before it
        assert written or (REPOSITORY / arguments[0]).is_file() or arguments[0] == "-m", words
    elif name == "springtune":
        command = main.get_command(None, arguments[0])
        assert command is not None, words
        known = {option for parameter in command.params for option in parameter.opts} | {"--help"}
        if arguments[0] == "run":  # what is not its own is Snakemake's
            study, *options = (word for word in arguments[1:] if word not in known)
            parse_args([*options, "--configfile", study])
            st.load_study(folder / study)
            return
        assert {word for word in arguments if word.startswith("--")} <= known, words


def agree(page, shown, printed):
    """Assert that what is printed is what the page shows; spaces at ends of lines and ``...`` are free."""
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert doctest.OutputChecker().check_output(shown, printed, flags), f"{page.name} shows\n{shown}\nbut\n{printed}"


def claims(readme):
    """Median and worst error of each definition in the table of the README, as texts."""
    return dict(re.findall(r"^\| `(\w+)` \|[^|]*\| (.*? \| .*?) \|$", readme.read_text(), re.MULTILINE))


def write_study(text, folder):
    """Write a study where its first line says, or add its sections to the one that is there; else None."""
    found = re.match(r"# (added to )?(config/[\w.]+)\n", text)
    if not found:
        return None
    path, study = folder / found[2], yaml.safe_load(text)
    if found[1]:
        whole = yaml.safe_load(path.read_text())
        for key, section in study.items():
            whole[key] = whole.get(key, {}) | section
        text = yaml.safe_dump(whole, sort_keys=False)
    path.write_text(text)
    return path


def follow(page, folder, run=None):
    """Do what a page says, in a folder that has `config/`, and assert that it prints what it shows.

    Python is run, a page in one namespace; studies are written and changed; commands of `springtune` are run, others
    are checked to be commands.

    Parameters
    ----------
    page, folder : Path
        The folder is the current one.
    run : callable, optional
        Given the path of a study whenever the page runs one.

    Yields
    ------
    tuple of (Block, str)
        Each block and what it printed.
    """
    names = {"__name__": "page"}
    for block in blocks(page):
        printed = ""
        if block.language == "python":
            with redirect_stdout(io.StringIO()) as output:
                exec(compile(block.code, page.name, "exec"), names)
            printed = output.getvalue()
        elif block.language == "yaml":
            assert yaml.safe_load(block.code)
            write_study(block.code, folder)
        elif block.language == "py":  # programs of others, which tests/programs runs
            compile(block.code, page.name, "exec")
        elif block.language == "toml":
            assert block.code in (REPOSITORY / "examples/plugin/pyproject.toml").read_text()
        else:
            assert block.language == "sh", block
            for line in block.code.splitlines():
                words = shlex.split(line, comments=True)
                check_command(words, folder)
                # One serves until it is stopped, the other gives its process to Snakemake, and so the tests'.
                if words[0] == "springtune" and words[1] not in ("browse", "run"):
                    done = CliRunner().invoke(main, words[1:])
                    usual = (0, 1) if words[1] == "diff" else (0,)  # which tells by it whether anything changed
                    assert done.exit_code in usual, (line, done.output, done.exception)
                    printed += done.output
                elif words[:2] in (["make", "study"], ["springtune", "run"]) and run:
                    run(words[2].removeprefix("STUDY=") if words[2:] else "config/paper.yaml")
        if block.shown is not None:
            agree(page, block.shown, printed)
        yield block, printed
