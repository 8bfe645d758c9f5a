"""Sheets as PDF: a page tree, one content stream a page, and Helvetica, which every reader has.

ISO 32000-1.  A point is 1/72 inch and y points up.  The viewer preference PrintScaling None asks print
dialogs to leave the size alone.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence

from vision3d.sheets.page import Disc, Page, Rect

__all__ = ["pdf_of"]

POINT = 72.0 / 25.4
KAPPA = 0.5522847498
"""Reach of the handles of four cubic curves that make a circle, in radii."""
HELVETICA = 0.52
"""Mean width of a letter, in sizes of the font; good enough to put words in the middle."""


def pdf_of(pages: Sequence[Page]) -> bytes:
    """Write sheets as one PDF, a page each, true to size when printed without scaling."""
    first_page = 4
    kids = " ".join(f"{first_page + 2 * k} 0 R" for k in range(len(pages)))
    title = pages[0].title if pages else "sheet"
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(pages)} >>".encode("ascii"),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
    ]
    for k, page in enumerate(pages):
        box = f"[0 0 {_n(page.width * POINT)} {_n(page.height * POINT)}]"
        rest = f"/Resources << /Font << /F 3 0 R >> >> /Contents {first_page + 2 * k + 1} 0 R"
        objects.append(f"<< /Type /Page /Parent 2 0 R /MediaBox {box} {rest} >>".encode("ascii"))
        stream = zlib.compress(_content(page))
        head = f"<< /Length {len(stream)} /Filter /FlateDecode >>\nstream\n".encode("ascii")
        objects.append(head + stream + b"\nendstream")
    objects.append(b"<< /Producer (factorlab) /Title (" + _string(title) + b") >>")
    return _file(objects)


def _file(objects: list[bytes]) -> bytes:
    """Objects 1, 2, … with the table of where they are; the last holds what is said about the file."""
    out = bytearray(b"%PDF-1.6\n%\xe2\xe3\xcf\xd3\n")
    places = []
    for number, body in enumerate(objects, 1):
        places.append(len(out))
        out += f"{number} 0 obj\n".encode("ascii") + body + b"\nendobj\n"
    table = len(out)
    out += f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n".encode("ascii")
    out += b"".join(f"{place:010d} 00000 n \n".encode("ascii") for place in places)
    trailer = f"<< /Size {len(objects) + 1} /Root 1 0 R /Info {len(objects)} 0 R >>"
    out += f"trailer\n{trailer}\nstartxref\n{table}\n%%EOF\n".encode("ascii")
    return bytes(out)


def _content(page: Page) -> bytes:
    """Operators that draw a page: shapes in millimetres from its top left corner, words in points."""
    parts = [f"q {_n(POINT)} 0 0 {_n(-POINT)} 0 {_n(page.height * POINT)} cm", "0 g"]
    parts += [_outline(shape) for shape in page.black]
    parts.append("f")
    for line in page.lines:
        pen = f"{_n(line.width)} w {_n(line.grey)} G"
        parts.append(f"{pen} {_n(line.x1)} {_n(line.y1)} m {_n(line.x2)} {_n(line.y2)} l S")
    parts.append("Q")
    content = "\n".join(parts).encode("ascii")
    for text in page.texts:
        x = text.x - (0.5 * HELVETICA * text.size * len(text.words) if text.middle else 0.0)
        place = f"{_n(x * POINT)} {_n((page.height - text.y) * POINT)}"
        content += f"\nBT /F {_n(text.size * POINT)} Tf {place} Td (".encode("ascii")
        content += _string(text.words) + b") Tj ET"
    return content


def _outline(shape: Rect | Disc) -> str:
    if isinstance(shape, Rect):
        return f"{_n(shape.x)} {_n(shape.y)} {_n(shape.width)} {_n(shape.height)} re"
    x, y, r = shape.x, shape.y, shape.radius
    k = KAPPA * r
    curves = [
        (x + r, y + k, x + k, y + r, x, y + r),
        (x - k, y + r, x - r, y + k, x - r, y),
        (x - r, y - k, x - k, y - r, x, y - r),
        (x + k, y - r, x + r, y - k, x + r, y),
    ]
    drawn = " ".join(" ".join(map(_n, curve)) + " c" for curve in curves)
    return f"{_n(x + r)} {_n(y)} m {drawn} h"


def _n(value: float) -> str:
    return f"{value:.5f}".rstrip("0").rstrip(".") or "0"


def _string(words: str) -> bytes:
    """Words as the inside of a PDF string; letters that WinAnsi lacks become question marks."""
    plain = words.encode("cp1252", "replace")
    return plain.replace(b"\\", b"\\\\").replace(b"(", b"\\(").replace(b")", b"\\)")
