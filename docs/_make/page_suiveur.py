"""The picture of the line follower's page: `factorlab l19 suiveur` in a browser, in its second attempt.

`make docs` runs it; it needs Chromium, and leaves the picture as it is where there is none.
"""

import io
import shutil
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from factorlab.l19.follower import FollowerSettings
from factorlab.live.follower import FollowerServer, FollowerSession
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "docs" / "pictures" / "suiveur.png"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WIDTH, HEIGHT, COLOURS = 1280, 1185, 160
FIRST = FollowerSettings(curve="circuit", noise=45.0, kp=6.0)


def main():
    """Drive twice, the second time with more gain, and take the picture on the way."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print("suiveur: left as it is, since there is no Chromium")
        return
    sys.path.insert(0, str(ROOT / "tests"))
    from chromium import Chromium

    with ExitStack() as ending, tempfile.TemporaryDirectory() as profile:
        session = FollowerSession(FIRST, wait=True)
        session.pace = 5.0
        ending.callback(session.close)
        server = FollowerServer(session, 0)
        ending.callback(server.close)
        session.start()
        window = ending.enter_context(Chromium(browser, Path(profile) / "profile"))
        window.call(
            "Emulation.setDeviceMetricsOverride",
            width=WIDTH,
            height=HEIGHT,
            deviceScaleFactor=1,
            mobile=False,
        )
        window.emulate("light")
        window.visit(server.address)
        window.until("document.body.dataset.steps > 400")
        session.change({"kp": 18.0})
        session.restart()
        window.until("document.body.dataset.journey === '2' && document.body.dataset.steps > 330")
        picture = Path(profile) / "page.png"
        window.screenshot(picture)
        image = Image.open(io.BytesIO(picture.read_bytes())).convert("RGB")
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(TARGET, optimize=True)
    print(f"{TARGET.relative_to(ROOT)}  {TARGET.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
