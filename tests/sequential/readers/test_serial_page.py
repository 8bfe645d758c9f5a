"""What docs/firmware.md says of the protocol is true."""

import math
import re
from pathlib import Path

from sequential.readers.serial import QuaternionFrame, Status, decode, encode, encode_line

PAGE = (Path(__file__).parents[3] / "docs" / "firmware.md").read_text(encoding="utf-8")


def test_the_frame_of_the_page_is_the_one_it_describes():
    (written,) = re.findall(r"^    (a5(?: [0-9a-f]{2})+)$", PAGE, re.MULTILINE)
    yaw = math.radians(45.0)
    q = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    frame = QuaternionFrame(41, 420_000, q, (0.01, -0.02, 0.0), Status.REST)
    assert bytes.fromhex(written) == encode(frame)


def test_the_line_of_the_page_is_a_line():
    (line,) = re.findall(r"^    (\$ATT.*)$", PAGE, re.MULTILINE)
    (frame,) = decode(f"{line}\r\n".encode())
    assert encode_line(frame) == f"{line}\r\n".encode()


def test_the_loop_of_the_page_runs():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(code, {"chunks": [b"\xa5", b"\x01"]})  # noqa: S102 - the page's own lines
