"""Figures small enough for a repository: few colours, not wider than a page."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["small_png"]

WIDTH_PX, MOST_BYTES = 1000, 60_000
STEPS = ((1.0, 96), (1.0, 48), (0.85, 40), (0.72, 32), (0.6, 24), (0.5, 24))  # of the width, and colours
# the colours of lines stay whatever the photographs of a figure need: Okabe and Ito's, black, white, grey
KEPT = "000000 ffffff 9a9a9a 0072b2 d55e00 009e73 cc79a7 56b4e9 b07c00"


def small_png(path: Path) -> bytes:
    """The picture as a palette PNG of about 60 kB, 100 where it holds photographs."""
    from PIL import Image

    with Image.open(path) as opened:
        whole = opened.convert("RGB")
    content = b""
    for share, colours in STEPS:
        width = min(whole.width, round(share * WIDTH_PX))
        size = (width, max(1, round(whole.height * width / whole.width)))
        content = _png(whole.resize(size, Image.Resampling.LANCZOS), colours)
        if len(content) <= MOST_BYTES:
            break
    return content


def _png(picture: Image, colours: int) -> bytes:
    from PIL import Image

    own = picture.quantize(colours, method=Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*own[: 3 * colours], *bytes.fromhex(KEPT)])
    few = picture.quantize(palette=palette, dither=Image.Dither.NONE)
    buffer = io.BytesIO()
    few.save(buffer, format="PNG", optimize=True)
    return buffer.getvalue()
