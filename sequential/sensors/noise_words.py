"""A noise fit in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from sequential.sensors.noise_fit import NoiseFit, Term

__all__ = ["coefficient_unit", "notes", "span"]

COARSE = 0.5  # share of repeated samples from which the resolution is said to hide the noise
LONG_S = 90.0


def coefficient_unit(term: Term, unit: str) -> str:
    """Unit of a coefficient of a sensor of unit `unit`: rad/s gives rad/s/√Hz for N."""
    own = unit or "unit"
    walk = {"rad/s": "rad/s²", "m/s²": "m/s³", "deg/s": "deg/s²"}.get(own, f"{own}/s")
    whole = {"rad/s": "rad", "m/s²": "m/s", "deg/s": "deg"}.get(own, f"{own}·s")
    return {"N": f"{own}/√Hz", "B": own, "K": f"{walk}/√Hz", "Q": whole, "R": walk}[term]


def span(seconds: float) -> str:
    """A length of time as one says it."""
    if seconds < LONG_S:
        return f"{seconds:.3g} s"
    if seconds < 60 * LONG_S:
        return f"{seconds / 60:.3g} min"
    return f"{seconds / 3600:.3g} h" if seconds < 48 * 3600 else f"{seconds / 86400:.3g} days"


def notes(fit: NoiseFit) -> tuple[str, ...]:
    """What a reader should know besides the numbers, one sentence each."""
    said = []
    if not fit.N.visible:
        said.append(
            f"White noise N is not visible under the slower noises: at most "
            f"{_amount(fit, 'N', fit.N.high)} (95 %)."
        )
    slow: tuple[tuple[Literal["B", "K"], str], ...] = (("B", "Bias instability B"), ("K", "Random walk K"))
    for term, name in slow:
        if not fit[term].visible:
            most = fit[term].high
            needed = fit.seconds_needed(term, 0.5 * most)
            # flicker under a random walk stays hidden, however long the record
            more = f" To see one of half that size, record for about {span(needed)}."
            hidden = needed < 1.5 * fit.duration or (term == "B" and fit.K.visible)
            said.append(
                f"{name} is not visible in {span(fit.duration)}: at most {_amount(fit, term, most)} (95 %)."
                f"{'' if hidden else more}"
            )
    if fit.Q.visible:
        said.append(
            f"Quantisation noise Q of {_amount(fit, 'Q', fit.Q.value)} rises towards short averaging times, "
            "slope -1; it is kept apart from N."
        )
    if fit.R.visible:
        said.append(
            f"A steady drift R of {_amount(fit, 'R', fit.R.value)} is kept apart from K: warm the sensor up "
            "for longer, or look at its temperature."
        )
    return (*said, *_disturbances(fit))


def _amount(fit: NoiseFit, term: Term, value: float) -> str:
    return f"{value:.3g} {coefficient_unit(term, fit.unit)}"


def _disturbances(fit: NoiseFit) -> list[str]:
    said = []
    if fit.top < 0.499 * fit.rate:
        said.append(
            f"Above {fit.top:.3g} Hz the spectrum is not that of white noise (a low-pass filter, or a "
            "vibration), so that part was left out."
        )
    if fit.lines:
        largest = sorted(fit.lines, key=lambda line: -line[1])[:3]
        where = ", ".join(f"{f:.3g} Hz (rms {rms:.2g})" for f, rms in largest)
        more = f" and {len(fit.lines) - 3} more" if len(fit.lines) > 3 else ""
        said.append(f"Something vibrates at {where}{more}; these lines were left out.")
    if fit.spikes:
        were = "lone outlier was" if fit.spikes == 1 else "lone outliers were"
        said.append(f"{fit.spikes} {were} replaced by the median around.")
    if fit.smooth:
        said.append(
            "The slowest motion is smoother than a random walk, as in a warm-up or a change of temperature: "
            "K and B tell its size, no more. Let the sensor warm up, or leave the beginning out."
        )
    if fit.misfit is not None:
        low, high, share = fit.misfit
        said.append(
            f"From {low:.2g} to {high:.2g} Hz the record holds {share:.2g} times the power of such noise: it "
            "was touched or vibrated, or its temperature changed, and the intervals are too narrow."
        )
    if fit.repeats > COARSE:
        said.append(
            f"{fit.repeats:.0%} of the samples repeat the one before: the resolution hides the noise, which "
            "may be larger or smaller than it seems."
        )
    return said
