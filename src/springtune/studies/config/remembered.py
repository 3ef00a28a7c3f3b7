"""Cache of values computed once for a study."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from .model import Study

MOST_STUDIES = 8

Answer = TypeVar("Answer")


def once_a_study(*names: str) -> "Callable[[Callable[[Study], Answer]], Callable[[Study], Answer]]":
    """Cache a function of a study while the named parts are the same objects."""

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
