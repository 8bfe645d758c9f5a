"""How old a picture is on a browser's canvas: frames carry their number as black and white squares."""

from __future__ import annotations

import importlib.util
import shutil
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from measure.live_client import Pictures, Served

BITS, SIDE = 12, 16  # squares, and their side in px
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WATCH = f"""(() => {{
    const picture = document.getElementById("picture");
    const canvas = new OffscreenCanvas({BITS * SIDE}, {SIDE});
    const context = canvas.getContext("2d", {{ willReadFrequently: true }});
    window.seen = [];
    const look = () => {{
        context.drawImage(picture, 0, 0);
        const {{ data }} = context.getImageData(0, 0, canvas.width, {SIDE});
        let number = 0;
        for (let k = 0; k < {BITS}; k++)
            number += (data[4 * ({SIDE // 2} * canvas.width + k * {SIDE} + {SIDE // 2})] > 127) << k;
        if (!seen.length || seen.at(-1)[0] !== number)
            seen.push([number, performance.timeOrigin + performance.now()]);
        requestAnimationFrame(look);
    }};
    look();
}})()"""


def numbered(images: list[np.ndarray]) -> list[np.ndarray]:
    """Copies of images (h, w) with their numbers in the top left corner."""
    found = []
    for k, image in enumerate(images):
        copy = image.copy()
        for bit in range(BITS):
            copy[:SIDE, bit * SIDE : (bit + 1) * SIDE] = 255 * (k >> bit & 1)
        found.append(copy)
    return found


def browser_latency_ms(page: Served, count: int, seconds: float) -> list[float] | None:
    """Ages (ms) of the pictures of a looped video of `count` numbered frames; None without a browser."""
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        return None
    sent: list[Pictures] = []
    taker = threading.Thread(target=lambda: sent.append(page.pictures(seconds + 2.0, warm_s=0.0)))
    with tempfile.TemporaryDirectory() as profile, _chromium()(path, profile) as window:
        window.visit(page.address)
        window.until("document.body.dataset.frame > 30", 60)
        taker.start()
        window.run(WATCH)
        time.sleep(seconds)
        seen = window.run("seen")
        taker.join()
    wall_ns = time.time_ns() - time.monotonic_ns()
    captured = {frame: ns + wall_ns for frame, ns in zip(sent[0].frames, sent[0].captured_ns, strict=True)}
    return [
        age for number, at_ms in seen[1:] if (age := _age(number, at_ms * 1e6, captured, count)) is not None
    ]


def _age(number: int, at_ns: float, captured: dict[int, int], count: int) -> float | None:
    """Since the last time that a frame of this number came."""
    ages = [at_ns - ns for frame, ns in captured.items() if frame % count == number and ns <= at_ns]
    return min(ages) * 1e-6 if ages else None


def _chromium() -> Any:
    """The window of the tests, which lie beside the benchmarks."""
    spec = importlib.util.spec_from_file_location("chromium", Path(__file__).parents[2] / "chromium.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Chromium
