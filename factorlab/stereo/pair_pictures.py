"""Pictures of two cameras, pair by pair: from names, patterns and folders, or frames of two videos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from factorlab.camera.pictures import LOOKED_AT, VIDEO_SUFFIXES, sharpness
from factorlab.stereo.pairing import pair_names
from sequential.errors import DataError
from vision3d.images import Image, ImageSet, LeftOut, image_paths, read_images

__all__ = ["PicturePair", "PicturePairs", "held_pairs", "open_pairs"]

LONGEST = 100_000  # frames, of a video that does not tell how many it has


@dataclass(frozen=True, slots=True, eq=False)
class PicturePair:
    """Pictures (h, w) of one moment; one may be missing."""

    name: str
    left: tuple[str, Image] | None
    right: tuple[str, Image] | None


@dataclass(frozen=True, slots=True, eq=False)
class PicturePairs:
    """Pairs of pictures of two cameras.

    Parameters
    ----------
    pairs : in order
    sizes : (width, height) of the left and of the right pictures, px
    left_out : pictures that cannot be used, each with its reason
    how : the pairs were found, in words
    given : how many moments there are pictures of, readable or not
    """

    pairs: tuple[PicturePair, ...]
    sizes: tuple[tuple[int, int], tuple[int, int]]
    left_out: tuple[LeftOut, ...]
    how: str
    given: int

    def side(self, side: int) -> list[tuple[str, Image]]:
        """Names and pictures of the left (0) or of the right (1) camera."""
        pictures = [pair.left if side == 0 else pair.right for pair in self.pairs]
        return [one for one in pictures if one is not None]


def open_pairs(left: Sequence[str], right: Sequence[str], frames: int = 40) -> PicturePairs:
    """Read the pictures that two lists of names, patterns, folders or videos stand for, and pair them.

    Parameters
    ----------
    frames : how many pairs are taken from two videos: the sharpest of as many equal stretches

    Raises
    ------
    DataError
        where nothing can be read, both sides are the same, or it cannot be told what belongs together.
    """
    videos = [len(one) == 1 and Path(one[0]).suffix.lower() in VIDEO_SUFFIXES for one in (left, right)]
    if all(videos):
        return _video_pairs(Path(left[0]), Path(right[0]), frames)
    if any(videos):
        raise DataError(
            "one side is a video and the other is not; give two videos taken together, or pictures"
        )
    paths = image_paths(left), image_paths(right)
    same = {path.resolve() for path in paths[0]} & {path.resolve() for path in paths[1]}
    if same:
        raise DataError(
            f"{min(same).name} is among the left and among the right pictures; give each camera its own"
        )
    pairing = pair_names(*([path.name for path in one] for one in paths))
    sets = tuple(read_images(one) for one in paths)
    found = tuple(_by_path(one, own) for one, own in zip(sets, paths, strict=True))
    pairs = [
        PicturePair(_pair_name(paths[0][i].name, paths[1][j].name), found[0].get(i), found[1].get(j))
        for i, j in pairing.pairs
    ]
    pairs += [PicturePair(paths[0][i].name, found[0].get(i), None) for i in pairing.left_alone]
    pairs += [PicturePair(paths[1][j].name, None, found[1].get(j)) for j in pairing.right_alone]
    left_out = [one for own in sets for one in own.left_out]
    left_out += [LeftOut(paths[0][i].name, "there is no right picture to it") for i in pairing.left_alone]
    left_out += [LeftOut(paths[1][j].name, "there is no left picture to it") for j in pairing.right_alone]
    kept = tuple(pair for pair in pairs if pair.left is not None or pair.right is not None)
    return _checked(
        PicturePairs(kept, (sets[0].size, sets[1].size), tuple(left_out), pairing.how, len(pairs))
    )


def held_pairs(pairs: Sequence[tuple[str, Image, Image]]) -> PicturePairs:
    """Pairs that are in memory already: names, left and right pictures (h, w)."""
    made = tuple(
        PicturePair(name, (f"{name} left", left), (f"{name} right", right)) for name, left, right in pairs
    )
    sizes = [made[0].left[1].shape[1::-1], made[0].right[1].shape[1::-1]]  # type: ignore[index]
    return PicturePairs(made, (sizes[0], sizes[1]), (), "in order", len(made))


def _checked(pairs: PicturePairs) -> PicturePairs:
    """Refuse pictures that are the same on both sides."""
    whole = [pair for pair in pairs.pairs if pair.left is not None and pair.right is not None]
    equal = [
        pair.name
        for pair in whole
        if pair.left is not None and pair.right is not None and np.array_equal(pair.left[1], pair.right[1])
    ]
    if equal and len(equal) == len(whole):
        raise DataError("left and right pictures are the same; were they copied from one camera?")
    return pairs


def _pair_name(left: str, right: str) -> str:
    return left if left == right else f"{left} + {right}"


def _by_path(found: ImageSet, paths: list[Path]) -> dict[int, tuple[str, Image]]:
    """Pictures that could be read, by the number of their path."""
    images = dict(found.images)
    names = {i: name for i, path in enumerate(paths) for name in (path.name, str(path)) if name in images}
    return {i: (name, images[name]) for i, name in names.items()}


def _video_pairs(left: Path, right: Path, count: int) -> PicturePairs:
    """The sharpest pair of frames of each of `count` equal stretches of two videos."""
    from vision3d.frames import open_frames

    best: dict[int, tuple[float, int, NDArray[np.uint8], NDArray[np.uint8]]] = {}
    with open_frames(left) as one, open_frames(right) as two:
        length = min(one.count or LONGEST, two.count or LONGEST)
        stretch, step = max(1.0, length / count), max(1, length // LOOKED_AT if one.count else 1)
        frames = [0, 0]
        for k, (a, b) in enumerate(zip_longest(one, two)):
            frames = [n + (frame is not None) for n, frame in zip(frames, (a, b), strict=True)]
            if k % step or a is None or b is None:
                continue
            # the blurred one of the two decides
            value = min(sharpness(a.grey), sharpness(b.grey))
            place = int(k / stretch)
            if place not in best or value > best[place][0]:
                best[place] = value, k, a.grey, b.grey
        sizes = one.size, two.size
    left_out = []
    if frames[0] != frames[1]:
        longer = left if frames[0] > frames[1] else right
        reason = (
            f"has {max(frames)} frames and the other video {min(frames)}: its last ones are not used; "
            "do both begin at the same moment?"
        )
        left_out = [LeftOut(longer.name, reason)]
    pairs = tuple(
        PicturePair(f"frame {k}", (f"{left.name} frame {k}", a), (f"{right.name} frame {k}", b))
        for _, k, a, b in best.values()
    )
    step = max(1, -(-len(pairs) // count))
    return PicturePairs(pairs[::step], sizes, tuple(left_out), "frame by frame", len(pairs[::step]))
