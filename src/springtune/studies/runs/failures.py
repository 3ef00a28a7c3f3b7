"""Tell failed tasks from broken programs."""

from springtune.mesh import MeshError
from springtune.springs import DefinitionError

REFUSALS = (DefinitionError, MeshError)


def own_reason(error: Exception) -> str:
    """Return the reason of a failed task, or an empty string if the program is broken.

    Examples
    --------
    >>> own_reason(ZeroDivisionError("division by zero"))
    'ZeroDivisionError: division by zero'
    >>> own_reason(TypeError("unsupported operand"))
    ''
    """
    if isinstance(error, REFUSALS):
        return str(error)
    told = f"{type(error).__name__}: {error}"
    if isinstance(error, RuntimeError):
        return "" if isinstance(error, NotImplementedError | RecursionError) else told
    # numpy's LinAlgError is a ValueError, and scipy has no name of its own for numbers that are not finite.
    named = type(error).__name__ == "LinAlgError" or "infs or NaNs" in str(error)
    return told if named or isinstance(error, ArithmeticError) else ""
