"""Matches of pairs of pictures, verified by the geometry of two views, in COLMAP's database."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from vision3d.sfm.database import name_in_database
from vision3d.sfm.extraction import PictureFeatures
from vision3d.sfm.library import colmap
from vision3d.sfm.pairs import worth_matching
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
    """Match pictures, all pairs of a small set."""
    theirs = colmap()
    matching, verification = theirs.FeatureMatchingOptions(), theirs.TwoViewGeometryOptions()
    matching.num_threads = settings.threads or -1
    verification.ransac.random_seed = settings.seed
    listed = database.with_suffix(".pairs")
    pairs = [(name_in_database(a), name_in_database(b)) for a, b in worth_matching(pictures)]
    for start in range(0, len(pairs), CHUNK):
        progress("matches", start, len(pairs))
        patience.check()
        listed.write_text("".join(f"{a} {b}\n" for a, b in pairs[start : start + CHUNK]), encoding="utf-8")
        pairing = theirs.ImportedPairingOptions()
        pairing.match_list_path = listed
        patience.run(
            partial(theirs.match_image_pairs, database, matching, pairing, verification, theirs.Device.cpu)
        )
