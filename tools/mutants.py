"""Mutation testing: small errors put into modules one at a time, and whether a test fails for each.

    python tools/mutants.py [--share 0.5] [--seconds 20] [MODULE ...]

`make mutants` installs what this needs. The errors are those of Cosmic Ray: one operator or number is another one, a
condition is turned round, a loop is left out. A process that has all third-party packages imported forks for each of
them, imports springtune with the mutated module in place of the one on disk, and calls those tests that ran the line,
as coverage.py noted it: first those that found most errors before, then the quickest. Limits are of the processor's
time: what another program needs changes no outcome.

What was found stands in build/mutants/results.jsonl, and is not tried again until the module or a test changes.
"""

import argparse
import ast
import fnmatch
import gc
import hashlib
import importlib
import importlib.machinery
import json
import os
import random
import resource
import signal
import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGE = REPOSITORY / "src/springtune"
FOLDER = REPOSITORY / "build/mutants"

MODULES = ("springs/*.py", "mechanics/*.py", "reference/*.py", "mesh/*.py", "studies/runs/keys.py")
"""What is mutated: where a wrong sign gives a wrong number that looks like a right one."""

TESTS = (
    *(f"tests/{room}" for room in ("problem", "mesh", "springs", "mechanics", "linalg", "reference", "scene")),
    *("tests/prediction", "tests/handover", "tests/engines", "tests/studies/kinds/test_benchmark.py"),
    *("tests/test_refused_calls.py", "tests/docs/test_which_numbers.py"),
    *("tests/studies/runs/test_keys.py", "tests/test_places.py"),
)
"""What may find a mutant: tests that are not slow, and that run in one process."""

OPERATORS = (
    *("NumberReplacer", "AddNot", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr"),
    *("ReplaceOrWithAnd", "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop"),
    *("ReplaceUnaryOperator_Delete_" + name for name in ("USub", "Not", "Invert")),
    *("ReplaceBinaryOperator_" + pair for pair in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul",
                                                    "Mod_Mul", "Pow_Mul", "BitAnd_BitOr", "BitOr_BitAnd")),
    *("ReplaceComparisonOperator_" + pair for pair in ("Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE",
                                                        "GtE_Gt", "GtE_Lt", "Eq_NotEq", "NotEq_Eq", "Is_IsNot",
                                                        "IsNot_Is")),
)  # fmt: skip
"""Of Cosmic Ray's operators one or two for each place: eleven for every `+` tell no more than one."""

FEW = 1.0
"""Seconds of the processor for the tests that are tried first."""

BREATH = 5.0
"""Seconds of the processor that imports may take."""


# -- which tests run which line ----------------------------------------------------------------------------------------


class Noted:
    """Plugin of pytest that notes what each test takes, and tells coverage.py which one runs."""

    def __init__(self, coverage=None):
        self.coverage, self.seconds, self.failed, self.first = coverage, {}, set(), None
        self.broken = False

    def pytest_collectreport(self, report):
        """After a file of tests was imported."""
        self.broken = self.broken or report.failed

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        """Around a test, its fixtures included."""
        if self.coverage is not None:
            self.coverage.switch_context(item.nodeid)
        begin = time.process_time()
        try:
            return (yield)
        finally:
            self.seconds[item.nodeid] = time.process_time() - begin
            if self.coverage is not None:
                self.coverage.switch_context("")

    def pytest_runtest_logreport(self, report):
        """After each phase of a test."""
        if report.failed:
            self.failed.add(report.nodeid)
            self.first = self.first or report.nodeid


def call_pytest(tests, plugin, *options):
    """Exit code of pytest in this process, without what takes it longer than the tests: rewriting and collecting."""
    quick = ["-q", "--assert=plain", "-o", "addopts=--strict-markers", "-m", "not slow"]
    for name in ("cacheprovider", "unraisableexception", "threadexception", "xdist"):
        quick += ["-p", f"no:{name}"]
    return pytest.main([*quick, *options, *tests], plugins=[plugin])


def note_tests(files, path):
    """Write which tests run which lines of files, and what each test takes."""
    from coverage import Coverage

    coverage = Coverage(include=[str(file) for file in files], data_file=None, config_file=False)
    coverage.start()
    plugin = Noted(coverage)
    call_pytest([one for one in TESTS if (REPOSITORY / one).exists()], plugin)
    coverage.stop()
    lines = {}
    for file in files:
        by_line = coverage.get_data().contexts_by_lineno(str(file))
        lines[name_of(file)] = {line: sorted(set(tests) - {""} - plugin.failed) for line, tests in by_line.items()}
    if plugin.failed:
        print(f"left out, since they fail without any error put in: {sorted(plugin.failed)}")
    files_of = {name: getattr(module, "__file__", None) or "" for name, module in sys.modules.items()}
    modules = sorted(name for name, file in files_of.items() if "-packages" in file)
    path.write_text(json.dumps({"seconds": plugin.seconds, "lines": lines, "modules": modules}))


# -- mutants -----------------------------------------------------------------------------------------------------------


def name_of(file):
    """Place of a module in the package."""
    return str(file.relative_to(PACKAGE))


def statements(tree):
    """First and last line of what belongs together, of each line: a statement, or the head of one with a body."""
    spans = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            body = getattr(node, "body", None)
            last = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno
            for line in range(node.lineno, last + 1):
                if line not in spans or spans[line][0] <= node.lineno:
                    spans[line] = (node.lineno, last)
    return spans


def left_out(tree):
    """Places without an effect on what is computed: annotations, who may write to a dataclass, the order of labels."""
    for node in ast.walk(tree):
        for part in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if part is not None:
                yield part
        if isinstance(node, ast.keyword) and node.arg in ("order", "frozen"):
            yield node.value
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            yield node


def mutants(file):
    """Errors that a module is tried with: dicts of operator, occurrence, line and column."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.operators.provider import OperatorProvider

    source = file.read_text()
    tree = ast.parse(source)
    out = [((n.lineno, n.col_offset), (n.end_lineno, n.end_col_offset)) for n in left_out(tree)]
    spans, provider, nodes = statements(tree), OperatorProvider(), list(ast_nodes(get_ast(source)))
    for name in OPERATORS:
        operator = provider[name]()
        places = (begin for node in nodes for begin, _ in operator.mutation_positions(node))
        for occurrence, place in enumerate(places):
            bare = source.splitlines()[place[0] - 1][place[1] :].startswith("*,")  # of keyword-only arguments
            if not bare and not any(begin <= place < end for begin, end in out):
                yield {"module": name_of(file), "operator": name, "occurrence": occurrence, "line": place[0],
                       "column": place[1], "span": spans.get(place[0], (place[0], place[0]))}  # fmt: skip


def mutated(source, mutant):
    """Source with the error in it."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.operators.provider import OperatorProvider

    return mutate_code(source, OperatorProvider()[mutant["operator"]](), mutant["occurrence"])


def tests_of(mutant, noted, seconds, found):
    """Tests that run the line of a mutant; those that found others of its module first, then the quickest."""
    of_lines = noted["lines"][mutant["module"]]
    first, last = mutant["span"]
    tests = {test for line in range(first, last + 1) for test in of_lines.get(str(line), ())}
    if not tests:  # it runs as the module is imported: a constant
        tests = {test for tests in of_lines.values() for test in tests}
    ordered = sorted(tests, key=lambda test: (-found[test] / (0.05 + noted["seconds"][test]), noted["seconds"][test]))
    chosen, total = [], 0.0
    for test in ordered:
        if total + noted["seconds"][test] <= seconds or not chosen:
            chosen.append(test)
            total += noted["seconds"][test]
    return chosen


def rounds(tests, noted):
    """Tests in two parts: a few of few files, which find most, and the others."""
    first, files, total = [], set(), 0.0
    for test in tests:
        file = test.partition("::")[0]
        if total + noted["seconds"][test] <= FEW and len(files | {file}) <= 2 or not first:
            first.append(test)
            files.add(file)
            total += noted["seconds"][test]
    others = [test for test in tests if test not in set(first)]
    return [first, others] if others else [first]


def tried(file, source, tests, seconds):
    """What becomes of tests with a source in place of a module's: an outcome, and the test that failed first."""
    reading, writing = os.pipe()
    if child := os.fork():
        os.close(writing)
        _, status, used = os.wait4(child, 0)
        with os.fdopen(reading) as pipe:
            told = pipe.read()
        if os.WIFSIGNALED(status):
            by = os.WTERMSIG(status)
            names = {signal.SIGXCPU: "endless", signal.SIGKILL: "endless", signal.SIGALRM: "waits"}
            return names.get(by, "crashes"), "", used.ru_utime + used.ru_stime
        code, _, test = told.partition(" ")
        outcome = {"0": "survived", "1": "killed", "2": "killed", "import": "killed"}.get(code, f"exit {code}")
        return outcome, test or code, used.ru_utime + used.ru_stime
    try:
        os.close(reading)
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, 1), os.dup2(nothing, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 3))
        resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.alarm(int(60 * seconds))
        loaded = importlib.machinery.SourceFileLoader.get_code

        def get_code(self, name):
            return compile(source, self.path, "exec") if self.path == str(file) else loaded(self, name)

        importlib.machinery.SourceFileLoader.get_code = get_code
        name = ".".join(("springtune", *file.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")
        try:
            importlib.import_module(name)
            assert not tests or sys.modules[name].__file__ == str(file)
        except BaseException:
            told = "import"
        else:
            plugin = Noted()
            code = call_pytest(tests, plugin, "-x", "--no-summary", "-o", "tmp_path_retention_policy=none")
            told = "import" if plugin.broken else f"{int(code)} {plugin.first or ''}"
        os.write(writing, told.encode())
    finally:
        os._exit(0)


# -- the run -----------------------------------------------------------------------------------------------------------


def changed_line(before, after):
    """The line that an error is in, as it was and as it is."""
    for one, other in zip(before.splitlines(), after.splitlines()):
        if one != other:
            return one.strip(), other.strip()
    return "", ""


def chosen(files, modules, share):
    """Files and mutants, of each module a share drawn from a fixed seed; modules take turns, so any part is fair."""
    turns = []
    for file in files:
        if any(fnmatch.fnmatch(name_of(file), one) for one in modules):
            of_file = list(mutants(file))
            random.Random(name_of(file)).shuffle(of_file)
            turns += [((number + 0.5) / len(of_file), file, one) for number, one in enumerate(of_file)]
    turns.sort(key=lambda turn: turn[:2])
    return [(file, mutant) for place, file, mutant in turns if place <= share]


def told(results):
    """Print how many of each module were found."""
    counts = defaultdict(Counter)
    for one in results.values():
        counts[one["module"]][one["outcome"]] += 1
    for module, of_module in sorted(counts.items()):
        print(
            f"{module:28} {sum(of_module.values()):5} tried",
            *(f"{n} {what}" for what, n in of_module.items()),
            sep=", ",
        )


def main():
    """Try mutants, and tell what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("modules", nargs="*", default=MODULES, metavar="MODULE", help="in src/springtune, * for any")
    parser.add_argument("--share", type=float, default=1.0, help="of the errors, drawn from a fixed seed")
    parser.add_argument("--seconds", type=float, default=20.0, help="of the processor for the tests of one error")
    parser.add_argument("--again", action="store_true", help="try those again that no test found")
    arguments = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    os.chdir(REPOSITORY)
    FOLDER.mkdir(parents=True, exist_ok=True)
    files = sorted(file for one in MODULES for file in PACKAGE.glob(one))
    noted_path, results_path = FOLDER / "tests.json", FOLDER / "results.jsonl"
    if not noted_path.exists():
        if child := os.fork():
            os.waitpid(child, 0)
        else:
            note_tests(files, noted_path)
            os._exit(0)
    noted = json.loads(noted_path.read_text())
    for name in noted["modules"]:
        try:
            importlib.import_module(name)
        except Exception:  # what only its own package may import
            pass
    gc.collect()
    gc.freeze()
    results = {}
    if results_path.exists():
        for line in results_path.read_text().splitlines():
            one = json.loads(line)
            results[one["digest"]] = one
    found = defaultdict(Counter)
    for one in results.values():
        if one["outcome"] == "killed":
            found[one["module"]][one["test"]] += 1
    with results_path.open("a") as output:
        for file, mutant in chosen(files, arguments.modules, arguments.share):
            module, source = mutant["module"], file.read_text()
            text = mutated(source, mutant)
            digest = hashlib.sha256(f"{module} {text}".encode()).hexdigest()[:16]
            if digest in results and not (arguments.again and results[digest]["outcome"] == "survived"):
                continue
            tests = tests_of(mutant, noted, arguments.seconds, found[module])
            outcome, test, used = "survived", "" if tests else "no test runs it", 0.0
            for part in rounds(tests, noted) if tests else ():
                limit = 10 * sum(map(noted["seconds"].get, part)) + BREATH
                outcome, test, more = tried(file, text, part, limit)
                used += more
                if outcome != "survived":
                    break
            if outcome == "killed":
                found[module][test] += 1
            before, after = changed_line(source, text)
            results[digest] = mutant | {"digest": digest, "outcome": outcome, "test": test, "seconds": round(used, 2),
                                        "tests": len(tests), "before": before, "after": after}  # fmt: skip
            output.write(json.dumps(results[digest]) + "\n")
            output.flush()
            if outcome not in ("killed", "endless"):
                print(f"{module}:{mutant['line']}: {outcome} {test} ({len(tests)} tests)\n    {before}\n    {after}",
                      flush=True)  # fmt: skip
    told(results)


if __name__ == "__main__":
    main()
