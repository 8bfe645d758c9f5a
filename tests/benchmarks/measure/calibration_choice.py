"""Choice of the lens on nine of the sample images: how well does it do on the four others?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import process_time

import numpy as np

from measure.calibration_spread import views_of
from measure.figures import Figure, say
from sequential.errors import FactorlabError
from vision3d.calibrate import Calibration, calibrate, choose_lens
from vision3d.lenses import LENSES
from vision3d.pose import estimate_pose
from vision3d.views import View

__all__ = ["choice_figures"]

TRAINED_ON = 9


def choice_figures(files: Sequence[Path], splits: int) -> dict[str, Figure]:
    """Row 4: median over random splits of RMS on the four, over that of the lens that is best there."""
    views = views_of(files)
    rng = np.random.default_rng(4)
    ratios, seconds, chosen = [], [], []
    for _ in range(splits):
        order = rng.permutation(len(views))
        train, test = ([views[k] for k in some] for some in (order[:TRAINED_ON], order[TRAINED_ON:]))
        began = process_time()
        lens = choose_lens(train).chosen
        seconds.append(process_time() - began)
        scores = {name: _held_out(train, test, name) for name in LENSES}
        best = min(scores, key=lambda name: scores[name])
        ratios.append(scores[lens] / scores[best])
        chosen.append(lens)
        say(f"  {lens} {scores[lens]:.4f} px, best {best} {scores[best]:.4f} px, {seconds[-1]:.1f} s")
    said = ", ".join(f"{name} {chosen.count(name)}x" for name in dict.fromkeys(chosen))
    return {
        "lens_choice_over_best": Figure(
            float(np.median(ratios)), "x", f"median of {splits} splits: {said}", 1.05, 1.02
        ),
        "lens_choice_over_best_worst": Figure(max(ratios), "x", "worst split; cv2 rational + thin 1.96"),
        "lens_choice_seconds": Figure(max(seconds), "s", "longest choice, CPU", None, 10.0),
    }


def _held_out(train: list[View], test: list[View], lens: str) -> float:
    """RMS over views that the calibration has not seen, their poses fitted; infinite where it failed."""
    try:
        fit: Calibration = calibrate(train, lens)
        poses = [estimate_pose(fit.camera, view.points, view.pixels, view.sigma_px) for view in test]
    except FactorlabError:
        return np.inf
    counts = np.array([len(view) for view in test])
    return float(
        np.sqrt(np.sum([n * pose.rms_px**2 for n, pose in zip(counts, poses, strict=True)]) / counts.sum())
    )
