"""Match two pictures: features, tentative matches, a robust geometry, a second pass under it, alignment."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from factorlab.match.chance import CHANCE_LOG10
from factorlab.match.fitting import Geometry, criterion, fit_essential_pair, fit_model
from factorlab.match.pictures import Picture, read_picture
from factorlab.match.second_pass import again
from factorlab.match.settings import MatchSettings

if TYPE_CHECKING:
    from factorlab.match.rivals import Rival
    from vision3d.features import Matches

__all__ = ["CLEAR_GAIN", "Matched", "match_pictures"]

Array = NDArray[np.float64]
ENOUGH_COMPANY = 3
CLEAR_GAIN = 3.0  # log of the odds between two kinds of geometry


@dataclass(eq=False)
class Matched:
    """What was found.

    Parameters
    ----------
    a, b : the pictures
    matches : the tentative ones, then those of the second pass
    tentative : how many the ratio test left
    first : the geometry of these, None where there is none
    geometry : the geometry after the second pass, or None where the first is chance or there is none
    pixels_a, pixels_b : (M, 2) px of the matches that `geometry` is of; of the tentative ones without it
    sigma_px : (M,) of the second, given the first
    refused : (K, 4) px of tentative matches that do not agree with the first geometry
    other : the first pass's fit of the other kind, where both were asked for
    gain : log of the odds of the kind chosen against the other: half their difference in Torr's criterion
    rival : a second reading of repeated texture; None where there is none
    repeated : shares of the features of either picture with a look-alike in the same picture
    identical : whether the pictures are the same, pixel by pixel
    """

    settings: MatchSettings
    a: Picture
    b: Picture
    matches: Matches
    tentative: int = 0
    first: Geometry | None = None
    geometry: Geometry | None = None
    pixels_a: Array = field(default_factory=lambda: np.empty((0, 2)))
    pixels_b: Array = field(default_factory=lambda: np.empty((0, 2)))
    sigma_px: Array = field(default_factory=lambda: np.empty(0))
    refused: Array = field(default_factory=lambda: np.empty((0, 4)))
    other: Geometry | None = None
    gain: float = 0.0
    rival: Rival | None = None
    repeated: tuple[float, float] = (0.0, 0.0)
    identical: bool = False
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def by_chance(self) -> bool:
        """Whether as many matches would agree in unrelated pictures."""
        return self.first is not None and self.first.chance_log10 > CHANCE_LOG10


def match_pictures(
    path_a: str, path_b: str, settings: MatchSettings, say: Callable[[str], object] = lambda _: None
) -> Matched:
    """Read two pictures and match them.

    Raises
    ------
    DataError, FileFormatError
        where a picture or a camera cannot be read.
    """
    from factorlab.match.rivals import find_rival, repeated_within

    began = time.perf_counter()
    a = read_picture(path_a, settings.camera, settings)
    b = read_picture(path_b, settings.camera_b or settings.camera, settings)
    done = Matched(settings, a, b, _tentative(a, b, settings), identical=_same(a, b))
    done.tentative = len(done.matches)
    done.seconds["features"] = time.perf_counter() - began
    say(f"{len(a.features)} and {len(b.features)} features")
    began = time.perf_counter()
    _first_pass(done)
    done.seconds["first pass"] = time.perf_counter() - began
    done.repeated = repeated_within(a.features), repeated_within(b.features)
    if done.first is None or done.by_chance:
        return done
    say(f"{done.first.count} of {done.tentative} matches agree; again under the {done.first.kind}")
    began = time.perf_counter()
    done.refused = np.hstack([done.pixels_a, done.pixels_b])[~done.first.inliers]
    sharp = again(done.first, done)
    done.geometry, done.matches = sharp.geometry, sharp.matches
    done.pixels_a, done.pixels_b, done.sigma_px = sharp.pixels_a, sharp.pixels_b, sharp.sigma_px
    done.seconds["second pass"] = time.perf_counter() - began
    began = time.perf_counter()
    done.rival = find_rival(done.geometry, a.features, b.features, sharp.matches)
    done.seconds["rivals"] = time.perf_counter() - began
    return done


def _same(a: Picture, b: Picture) -> bool:
    return a.image.shape == b.image.shape and bool(np.array_equal(a.image, b.image))


def _tentative(a: Picture, b: Picture, settings: MatchSettings) -> Matches:
    """What the ratio test leaves, matches with most company first."""
    from vision3d.features import match_features, supporters

    matches = match_features(a.features, b.features, ratio=settings.ratio)
    company = supporters(a.features, b.features, matches)
    return matches.take(np.lexsort((matches.ratio, -np.minimum(company, ENOUGH_COMPANY))))


def _first_pass(done: Matched) -> None:
    """The geometry that the tentative matches share."""
    a, b, settings = done.a.features, done.b.features, done.settings
    done.pixels_a, done.pixels_b = done.matches.points(a, b)
    own, theirs = done.matches.sigma_px(a, b)
    done.sigma_px = np.hypot(theirs, own)
    rng = np.random.default_rng(settings.seed)
    if settings.model == "essential" and done.a.camera is not None and done.b.camera is not None:
        cameras = done.a.camera, done.b.camera
        done.first = fit_essential_pair(cameras, done.pixels_a, done.pixels_b, settings, rng=rng)
        return
    kinds = ("homography", "fundamental") if settings.model == "auto" else (settings.model,)
    fits = [fit_model(kind, done.pixels_a, done.pixels_b, settings, rng=rng) for kind in kinds]
    found = [one for one in fits if one is not None]
    if not found:
        return
    found.sort(key=lambda one: one.chance_log10)
    if len(found) == 2 and found[0].chance_log10 <= CHANCE_LOG10:
        sigma = max(0.3, min(one.sigma_px for one in found))
        scores = {id(one): criterion(one, sigma, done.pixels_a) for one in found}
        # the simpler one unless the other is clearly better
        found.sort(key=lambda one: scores[id(one)] - (2.0 * CLEAR_GAIN if one.kind == "homography" else 0.0))
        done.other, done.gain = found[1], 0.5 * (scores[id(found[1])] - scores[id(found[0])])
    done.first = found[0]
