"""Where a model finds its part of the state: offsets into a product manifold."""

from __future__ import annotations

from sequential.errors import ModelError
from sequential.manifold import Manifold, Product

__all__ = ["find_part"]


def find_part(
    manifold: Manifold, kinds: tuple[type[Manifold], ...], name: str | None, who: str
) -> tuple[int, int, Manifold]:
    """Storage start, tangent start and manifold of a part.

    Without a name: the whole state, or the first part of one of the wanted kinds.

    Raises
    ------
    ModelError
        where there is no such part.
    """
    if not isinstance(manifold, Product):
        if name is None and isinstance(manifold, kinds):
            return 0, 0, manifold
    else:
        for part, member in manifold.parts.items():
            if (name is None or part == name) and isinstance(member, kinds):
                return manifold.storage(part).start, manifold.tangent(part).start, member
    wanted = " or ".join(kind.__name__ for kind in kinds)
    what = f"a part {name!r} that is a {wanted}" if name else f"a state, or a part of one, that is a {wanted}"
    msg = f"{who} needs {what}; the state is {manifold}"
    raise ModelError(msg)
