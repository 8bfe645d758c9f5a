"""What both cameras of a rig saw of a board at one moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sequential.errors import DataError
from vision3d.views import View

__all__ = ["ViewPair", "pairs_of_views"]


@dataclass(frozen=True, eq=False)
class ViewPair:
    """A board in the left and in the right image of one moment; one of them may not show it.

    Parameters
    ----------
    name : of the pair
    left, right : where its corners were seen; None where they were not
    """

    name: str
    left: View | None
    right: View | None

    def __post_init__(self) -> None:
        if self.left is None and self.right is None:
            raise DataError(f"the pair {self.name} shows the board in neither image; leave it out")

    @property
    def is_whole(self) -> bool:
        """Whether both cameras saw the board."""
        return self.left is not None and self.right is not None

    @property
    def views(self) -> tuple[View, ...]:
        """The one or two views."""
        return tuple(view for view in (self.left, self.right) if view is not None)

    def halves(self) -> tuple[ViewPair, ...]:
        """The pair as two moments: each camera saw a board, but not the same one."""
        sides = ((self.left, None), (None, self.right))
        return tuple(ViewPair(self.name, *side) for side in sides if any(side))

    def common(self) -> tuple[View, View]:
        """Both views with the corners that both saw, in one order.

        Raises
        ------
        DataError
            where one camera did not see the board.
        """
        if self.left is None or self.right is None:
            raise DataError(f"only one camera saw the board of {self.name}")
        _, a, b = np.intersect1d(self.left.ids, self.right.ids, return_indices=True)
        return self.left.subset(a), self.right.subset(b)


def pairs_of_views(
    left: Sequence[View | None], right: Sequence[View | None], names: Sequence[str] | None = None
) -> tuple[ViewPair, ...]:
    """Pair views in order; None where a camera did not see the board.

    Raises
    ------
    DataError
        where there are not as many of one side as of the other.
    """
    if len(left) != len(right):
        raise DataError(
            f"{len(left)} left and {len(right)} right views do not make pairs; give as many of each, with "
            "None where a camera did not see the board"
        )
    found = []
    for k, (a, b) in enumerate(zip(left, right, strict=True)):
        if a is None and b is None:
            continue
        name = names[k] if names is not None else " + ".join(view.name for view in (a, b) if view)
        found.append(ViewPair(name, a, b))
    return tuple(found)
