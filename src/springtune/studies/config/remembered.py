"""What is asked of a study for each of its scenes, found once."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from .model import Study

MOST_STUDIES = 8
"""Studies whose answers are kept: those that a paper reads are planned in one process."""

Answer = TypeVar("Answer")


def once_a_study(*names: str) -> "Callable[[Callable[[Study], Answer]], Callable[[Study], Answer]]":
    """Decorator of a function of a study that is called once as long as some of its parts are the same objects."""

    def decorate(function: "Callable[[Study], Answer]") -> "Callable[[Study], Answer]":
        # Parts by their places in memory, and the parts themselves, so that no other objects come to be there.
        known: list[tuple[list[int], Answer, list[Any]]] = []

        @wraps(function)
        def answer(study: "Study") -> Answer:
            places = [id(getattr(study, name)) for name in names]
            for before, found, _ in known:
                if before == places:
                    return found
            known.insert(0, (places, function(study), [getattr(study, name) for name in names]))
            del known[MOST_STUDIES:]
            return known[0][1]

        return answer

    return decorate
