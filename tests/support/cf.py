"""What a checker of the CF conventions has against a file."""

import warnings


def complaints(path):
    """Errors and warnings of the compliance checker of IOOS, for CF 1.11.

    Two of its own checks stop at what they do not expect, whatever a file holds, and are not counted: differences of
    texts in a coordinate of labels, and a dimension `time` in every file that has more than one group. Of `cf_role` it
    knows what stood in CF 1.6, so that those of UGRID, which belong to CF since 1.11, are not counted either.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from compliance_checker.runner import CheckSuite

        suite = CheckSuite()
        suite.load_all_available_checkers()
        opened = suite.load_dataset(str(path))
        try:
            (results, stopped), *others = suite.run_all(opened, ["cf:1.11"]).values()
        finally:
            opened.close()
    assert not others
    known = {"check_coordinate_variables_strict_monotonicity", "check_invalid_same_named_dimension_across_groups"}
    found = [f"{name}: {error[0]!r}" for name, error in stopped.items() if name.rpartition(".")[2] not in known]
    for result in results:
        value = result.value
        if not (value[0] == value[1] if isinstance(value, tuple) else value):
            found += [text for text in result.msgs or [str(result.name)] if "cf_role" not in text]
    return found
