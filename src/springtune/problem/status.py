"""Status of a solve: one set of flags from the equilibrium to the dataset."""

from enum import IntEnum


class Status(IntEnum):
    """Status of a solve, such as a scene or a point of a curve; flags of a dataset's variables ``status``.

    Stored as a number; its text is the flag's meaning.

    Attributes
    ----------
    NOT_REQUESTED
        Was not requested.
    SOLVED
        A stable equilibrium.
    LINEAR_ONLY
        Only the linear equilibrium.
    NOT_CONVERGED
        No equilibrium was found.
    UNSTABLE
        An unstable equilibrium, or an unstable path to it.
    FAILED
        Nothing to solve: a definition refuses the mesh, a reference is missing, or the program failed.

    Examples
    --------
    >>> import springtune as st
    >>> str(st.Status.NOT_CONVERGED), int(st.Status.NOT_CONVERGED)
    ('not_converged', 3)
    >>> st.Status(4)
    <Status.UNSTABLE: 4>
    """

    NOT_REQUESTED = 0
    SOLVED = 1
    LINEAR_ONLY = 2
    NOT_CONVERGED = 3
    UNSTABLE = 4
    FAILED = 5

    def __str__(self) -> str:
        return self.name.lower()
