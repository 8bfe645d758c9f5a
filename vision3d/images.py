"""Pictures from files: 8 bits, one size, never turned, and a sentence for each that cannot be used.

    pictures = read_images(["left/", "more/*.jpg"])
    for name, image in pictures: ...
    pictures.left_out                  # LeftOut(name, reason), …

An orientation written by a phone (EXIF) is ignored: a camera is calibrated on the pixels of its sensor, and
pictures that a viewer would turn lie in the same pixels as those it would not.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sequential.errors import DataError, FileFormatError

__all__ = ["ImageSet", "LeftOut", "image_paths", "png_bytes", "read_image", "read_images"]

Image = NDArray[np.uint8]
OPAQUE = 255
RAW_SUFFIXES = frozenset((".arw", ".cr2", ".cr3", ".dng", ".nef", ".orf", ".raf", ".rw2"))


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A picture that is not used, and why."""

    name: str
    reason: str

    def __str__(self) -> str:
        return f"{self.name}: {self.reason}"


@dataclass(frozen=True, slots=True)
class ImageSet:
    """Pictures of one size.

    Parameters
    ----------
    images : (name, image) in order; (h, w) uint8, or (h, w, 3) BGR where colour was asked for
    size : (width, height), px
    left_out : pictures that are not among them, each with its reason
    """

    images: tuple[tuple[str, Image], ...]
    size: tuple[int, int]
    left_out: tuple[LeftOut, ...] = ()

    def __iter__(self) -> Iterator[tuple[str, Image]]:
        return iter(self.images)

    def __len__(self) -> int:
        return len(self.images)


def read_image(path: str | os.PathLike[str], *, colour: bool | None = False) -> Image:
    """Read one picture.

    Parameters
    ----------
    path : of a picture in any format that OpenCV reads
    colour : give (h, w, 3) BGR instead of grey levels (h, w); None: whichever the file holds

    Returns
    -------
    Array
        uint8.  Sixteen bits are brought to eight by the depth in use (12-bit sensors fill 4095 of 65535);
        what is transparent lies on white; an orientation in EXIF is ignored.

    Raises
    ------
    DataError
        where there is no such file.
    FileFormatError
        where it is empty, cut off, no picture, or of floating-point numbers.
    """
    where = Path(path)
    if not where.is_file():
        raise DataError(f"there is no file {where}" + (": it is a folder" if where.is_dir() else ""))
    content = where.read_bytes()
    if not content:
        raise FileFormatError(f"{where} is empty (0 bytes); copy it again from the camera")
    if _cut_off(content):
        raise FileFormatError(
            f"{where} is cut off: it ends before its picture does; copy it again from the camera"
        )
    raw = where.suffix.lower() in RAW_SUFFIXES  # a TIFF to OpenCV, which would give the preview in it
    picture = None if raw else _decoded(content)
    if picture is None:
        kind = "raw data of a sensor" if raw else "HEIC, as telephones write it" if _is_heic(content) else ""
        hint = f"it is {kind}; convert it to PNG or JPEG first" if kind else "is it one, and whole?"
        raise FileFormatError(f"{where} cannot be read as a picture; {hint}")
    if picture.dtype not in (np.uint8, np.uint16):
        raise FileFormatError(
            f"{where} holds {picture.dtype} numbers; pictures of 8 or 16 bits are read, save it as PNG"
        )
    return _channels(_eight_bits(picture), colour=colour)


def read_images(
    sources: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], *, colour: bool = False
) -> ImageSet:
    """Read many pictures of one camera; what cannot be used is left out and told.

    Parameters
    ----------
    sources : files, folders or patterns (`left*.jpg`), in order
    colour : give (h, w, 3) BGR instead of grey levels (h, w)

    Returns
    -------
    ImageSet
        left out are pictures that cannot be read, that have another size than most, or that are a copy of
        another one, which would count its corners twice.

    Raises
    ------
    DataError
        where there is no picture at all, or where no size is that of most of them.
    """
    paths = image_paths(sources)
    names = _short_names(paths)
    images: dict[str, Image] = {}
    left_out: dict[str, str] = {}
    for name, path in zip(names, paths, strict=True):
        try:
            images[name] = read_image(path, colour=colour)
        except (DataError, OSError) as error:
            left_out[name] = str(error).removeprefix(f"{path} ")
    if not images:
        raise FileFormatError(
            f"none of the {len(paths)} pictures can be read; {paths[0].name} {left_out[names[0]]}"
        )
    size = _size_of_most(images)
    kept: dict[bytes, str] = {}
    for name, image in list(images.items()):
        if (reason := _odd_size(image, size)) or (reason := _copy_of(name, image, kept)):
            left_out[name] = reason
            del images[name]
    order = {name: i for i, name in enumerate(names)}
    listed = sorted(left_out.items(), key=lambda item: order[item[0]])
    return ImageSet(tuple(images.items()), size, tuple(LeftOut(*item) for item in listed))


def image_paths(sources: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> list[Path]:
    """Files of folders, patterns and names, in order, each once.

    Raises
    ------
    DataError
        where a name does not exist, a folder or pattern holds no picture, or nothing was given.
    """
    from vision3d.frames.files import find_images, is_pattern, require_path

    found: list[Path] = []
    for source in [sources] if isinstance(sources, str | os.PathLike) else sources:
        text = os.fspath(source)
        if is_pattern(text) or require_path(text).is_dir():
            found += find_images(text)
        else:
            found.append(Path(text))
    if not found:
        raise DataError("no picture was given; name files, a folder or a pattern such as left*.jpg")
    return list(dict.fromkeys(found))


def _short_names(paths: Sequence[Path]) -> list[str]:
    """File names, with their folders where two are alike."""
    twice = {name for name, n in Counter(path.name for path in paths).items() if n > 1}
    return [str(path) if path.name in twice else path.name for path in paths]


def _decoded(content: bytes) -> NDArray[Any] | None:
    import cv2

    from vision3d.frames.source import quiet

    with quiet():
        try:
            # unchanged means neither turned nor converted
            return cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            return None


def _is_heic(content: bytes) -> bool:
    return content[4:8] == b"ftyp" and content[8:12] in {b"heic", b"heix", b"hevc", b"mif1", b"msf1"}


def _cut_off(content: bytes) -> bool:
    """Whether a JPEG or PNG ends before its picture does: some versions decode the rest as grey."""
    if content.startswith(b"\x89PNG"):
        return b"IEND" not in content[-4096:]
    if not content.startswith(b"\xff\xd8"):
        return False
    at = 2
    while at + 4 <= len(content) and content[at] == 0xFF:
        if content[at + 1] == 0xDA:  # the scan begins; a thumbnail before it has its own end
            return content.find(b"\xff\xd9", at) < 0
        at += 2 + int.from_bytes(content[at + 2 : at + 4], "big")
    return True


def _eight_bits(picture: NDArray[Any]) -> Image:
    if picture.dtype == np.uint8:
        return picture
    colours = picture[..., :3] if picture.ndim == 3 else picture
    shift = max(0, int(colours.max()).bit_length() - 8)
    narrow = (colours >> shift).astype(np.uint8)
    if picture.ndim == 3 and picture.shape[2] == 4:
        return np.dstack([narrow, (picture[..., 3] >> 8).astype(np.uint8)])
    return narrow


def _channels(picture: Image, *, colour: bool | None) -> Image:
    import cv2

    if picture.ndim == 3 and picture.shape[2] == 2:
        picture = np.dstack([picture[..., 0]] * 3 + [picture[..., 1]])
    if picture.ndim == 3 and picture.shape[2] == 4:
        opacity = picture[..., 3:].astype(np.uint16)
        over = picture[..., :3] * opacity + OPAQUE * (OPAQUE - opacity)
        picture = ((over + OPAQUE // 2) // OPAQUE).astype(np.uint8)
    if colour is None:
        return np.ascontiguousarray(picture[..., 0] if picture.shape[2:] == (1,) else picture)
    if colour:
        wide = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture
        return np.ascontiguousarray(wide, dtype=np.uint8)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
    return np.ascontiguousarray(grey, dtype=np.uint8)


def _size_of_most(images: dict[str, Image]) -> tuple[int, int]:
    counts = Counter(image.shape[1::-1] for image in images.values())
    ranked = counts.most_common(2)
    if len(ranked) == 2 and ranked[0][1] == ranked[1][1]:
        listed = ", ".join(f"{n} of {width}x{height}" for (width, height), n in counts.most_common())
        raise DataError(
            f"the pictures have different sizes ({listed}) and none is that of most; a camera is calibrated "
            "at one size, so give the pictures of one"
        )
    width, height = ranked[0][0]
    return int(width), int(height)


def _odd_size(image: Image, size: tuple[int, int]) -> str:
    height, width = image.shape[:2]
    if (width, height) == size:
        return ""
    turned = "; it was turned by 90° and saved again" if (height, width) == size else ""
    return f"is {width}x{height} px and most pictures are {size[0]}x{size[1]}{turned}"


def _copy_of(name: str, image: Image, kept: dict[bytes, str]) -> str:
    from hashlib import blake2b

    first = kept.setdefault(blake2b(image.tobytes(), digest_size=16).digest(), name)
    return "" if first == name else f"is the same picture as {first}, whose corners would count twice"


def png_bytes(image: NDArray[Any]) -> bytes:
    """A picture of 8 or 16 bits, grey or BGR, as the content of a PNG file."""
    import cv2

    return bytes(cv2.imencode(".png", image)[1])
