"""Matches of pairs of pictures, verified by the geometry of two views, in COLMAP's database."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations
from pathlib import Path

from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.library import colmap
from vision3d.sfm.patience import Patience
from vision3d.sfm.settings import SfmSettings

__all__ = ["match_all"]

CHUNK = 100  # pairs between two looks at the clock


def match_all(
    database: Path,
    pictures: Sequence[PictureFeatures],
    settings: SfmSettings,
    patience: Patience,
    progress: Callable[[str, int, int], None],
) -> None:
    """Match every picture with every other one."""
    theirs = colmap()
    matching, verification = theirs.FeatureMatchingOptions(), theirs.TwoViewGeometryOptions()
    matching.num_threads = settings.threads or -1
    verification.ransac.random_seed = settings.seed
    listed, pairs = database.with_suffix(".pairs"), list(combinations([one.name for one in pictures], 2))
    for start in range(0, len(pairs), CHUNK):
        progress("matches", start, len(pairs))
        patience.check()
        listed.write_text("".join(f"{a} {b}\n" for a, b in pairs[start : start + CHUNK]), encoding="utf-8")
        pairing = theirs.ImportedPairingOptions()
        pairing.match_list_path = listed
        patience.run(
            partial(theirs.match_image_pairs, database, matching, pairing, verification, theirs.Device.cpu)
        )
