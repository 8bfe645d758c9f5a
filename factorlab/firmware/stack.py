"""Worst-case stack of a function: the compiler's frames summed along the deepest path of the call graph."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from sequential.errors import DataError

__all__ = ["call_graph", "deepest", "frames"]

FUNCTION = re.compile(r"^[0-9a-f]+ <([^>]+)>:$")
CALL = re.compile(r"\t(?:bl|blx|b|b\.w|b\.n|b\w\w|call|rcall|jmp|rjmp)\s.*<([^>+]+)>$")
INDIRECT = re.compile(r"\t(?:blx\s+r\d|icall|eicall)")
PUSH = re.compile(r"\tpush\t")
AVR_RETURN = 2  # bytes that a call pushes on an ATmega328P


def frames(folder: Path) -> dict[str, int]:
    """Bytes of stack of each function, by the `.su` files that `-fstack-usage` left in a folder.

    Raises
    ------
    DataError
        where a frame has no bound.
    """
    found: dict[str, int] = {}
    for path in sorted(folder.rglob("*.su")):
        for line in path.read_text(encoding="utf-8").splitlines():
            where, size, kind = line.split("\t")
            name = where.rsplit(":", 1)[1]
            if "dynamic" in kind and "bounded" not in kind:
                raise DataError(
                    f"the stack of {name} has no bound ({path.name}); give its arrays a fixed size"
                )
            found[name] = max(found.get(name, 0), int(size))
    return found


def call_graph(disassembly: str) -> tuple[dict[str, set[str]], dict[str, int]]:
    """What each function calls, and the pushes each one makes, by `objdump -d`.

    Raises
    ------
    DataError
        where a function of ours calls through a pointer.
    """
    calls: dict[str, set[str]] = {}
    pushes: dict[str, int] = {}
    name = ""
    for line in disassembly.splitlines():
        if head := FUNCTION.match(line):
            name = head[1]
            calls[name], pushes[name] = set(), 0
        elif name and (call := CALL.search(line)) and call[1] != name:
            calls[name].add(call[1])
        elif name and PUSH.search(line):
            pushes[name] += 1
        elif name and INDIRECT.search(line):
            calls[name].add("*")
    return calls, pushes


def deepest(
    entry: str, calls: Mapping[str, set[str]], own: Mapping[str, int], pushes: Mapping[str, int]
) -> tuple[int, tuple[str, ...]]:
    """Bytes on the deepest path from a function, and the path.

    Parameters
    ----------
    entry : where the path begins
    calls, pushes : as `call_graph` gives them
    own : as `frames` gives them; a function of the compiler's library counts its pushes and its return

    Raises
    ------
    DataError
        where the function is not there, calls itself, or calls through a pointer.
    """
    return _deepest(entry, calls, own, pushes, ())


def _deepest(
    name: str,
    calls: Mapping[str, set[str]],
    own: Mapping[str, int],
    pushes: Mapping[str, int],
    above: tuple[str, ...],
) -> tuple[int, tuple[str, ...]]:
    if name in above:
        raise DataError(f"{name} calls itself by way of {' > '.join(above)}: its stack has no bound")
    if name == "*":
        raise DataError(f"{above[-1]} calls through a pointer: its stack cannot be bounded")
    if name not in calls:
        raise DataError(f"there is no function {name} in the image")
    below = [_deepest(one, calls, own, pushes, (*above, name)) for one in sorted(calls[name])]
    size, path = max(below, default=(0, ()))
    here = own.get(name, pushes[name] + AVR_RETURN)
    return here + size, (name, *path)
