"""What became of a solve: one set of flags from the equilibrium to the dataset."""

from enum import IntEnum


class Status(IntEnum):
    """What became of a scene, a curve's point or any other solve; the flags of a dataset's variables ``status``.

    Its text is the flag's meaning in a dataset, and it is stored as a number.

    Attributes
    ----------
    NOT_REQUESTED
        Nobody asked for it.
    SOLVED
        A stable equilibrium.
    LINEAR_ONLY
        The linear equilibrium alone.
    NOT_CONVERGED
        No equilibrium was found.
    UNSTABLE
        An equilibrium that the body would leave, or the path to it would.
    FAILED
        There is nothing to solve: a definition refuses the mesh, a reference is missing, the program failed.

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
