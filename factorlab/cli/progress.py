"""A progress bar on a terminal, silence elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["bar"]


def silent(what: str, done: int, total: int) -> None:
    """Tell nobody."""


@contextmanager
def bar(name: str, *, shown: bool) -> Iterator[Callable[[str, int, int], None]]:
    """A function to call with what is being done, how much is done and out of how much."""
    if not shown:
        yield silent
        return
    from tqdm import tqdm

    with tqdm(desc=name, leave=False, bar_format="{desc} {bar} {n_fmt}/{total_fmt} {elapsed}") as line:

        def show(what: str, done: int, total: int) -> None:
            line.total = total
            line.n = done
            line.set_description_str(f"{name}: {what}")
            line.refresh()

        yield show
