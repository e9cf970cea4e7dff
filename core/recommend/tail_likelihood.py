"""The likelihood of a tail: peaks over a level come at random, and exceed it as a generalised Pareto law has it.

Levels are in whatever unit the peaks are.

Coles, An Introduction to Statistical Modeling of Extreme Values, 2001, ch. 4 and 7: peaks over u come at rate lambda,
and P(peak > x) = (1 + xi (x - u) / sigma)^(-1/xi). Bounds are those of the profile likelihood, taken on a grid of
(sigma, xi): for each of its points the largest lambda that the deviance leaves room for is known in closed form.

Where peaks come in minutes or logs that differ, as many of them tell less: the deviance of their count is divided by
the dispersion of the counts, that of their sizes by the dispersion of the sizes (Chandler and Bate 2007, inference for
clustered data by an adjusted independence log-likelihood). What is believed of the shape beforehand is not divided.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

#: What is believed of the shape before data. Minutes of data leave +-0.2 open, which for rare alarms is a factor of
#: several. So the shape is at most 0, the exponential law, unless the peaks themselves show a heavier tail.
SHAPE_MEAN, SHAPE_SD = 0.0, 0.1
#: Deviance by which a heavier tail must fit better: one-sided 95 %.
_HEAVIER = 2.71
_SHAPES = np.linspace(-0.5, 0.5, 51)
_SCALES = 81
_TINY = 1e-9
#: x and x - 1 - ln x, for the largest rate of a Poisson process that a deviance leaves room for.
_RATIO = 1.0 + np.geomspace(1e-6, 1e3, 4000)
_ROOM = _RATIO - 1.0 - np.log(_RATIO)


@dataclass(frozen=True, slots=True, eq=False)
class TailLikelihood:
    """Rate and level of the peaks of one joint, with bounds.

    Attributes:
        level: u.
        scale, shape: sigma and xi at the largest likelihood.
        rate_per_hour: lambda there.
        peaks: number of them.
        heavy: whether the peaks show a tail heavier than exponential.
        count_dispersion: what the deviance of the count is divided by, 1 at least.
        scales, shapes, deviance: (g,) points of the grid and how much less likely they are, dispersion included.
    """

    level: float
    scale: float
    shape: float
    rate_per_hour: float
    peaks: int
    heavy: bool
    count_dispersion: float
    scales: FloatArray
    shapes: FloatArray
    deviance: FloatArray

    def rate_at(self, gamma: float) -> float:
        """The likeliest rate of peaks above a level at or over u, 1/h."""
        left = _survival(np.array([self.shape]), np.array([self.scale]), gamma - self.level)
        return self.rate_per_hour * float(left[0])

    def rate_bound(self, gamma: float, quantile: float) -> float:
        """With a confidence no more peaks an hour than this lie above a level at or over u.

        Args:
            gamma: the level.
            quantile: of the signed root of the deviance, 1.645 for one-sided 95 %.
        """
        rates, inside = self._rates(quantile)
        left = _survival(self.shapes[inside], self.scales[inside], gamma - self.level)
        return float(np.max(rates * left))

    def level_bound(self, rate_per_hour: float, quantile: float, times: float = 1.0) -> float:
        """The level that with a confidence is passed no more often than this; u at least.

        Args:
            rate_per_hour: the rate.
            quantile: as of :meth:`rate_bound`.
            times: the bound as it would be of so many times the hours, if they continue as these do.
        """
        rates, inside = self._rates(quantile, times)
        return float(np.max(_level(self.shapes[inside], self.scales[inside], rates / rate_per_hour))) + self.level

    def least_level(self, rate_per_hour: float, quantile: float) -> float:
        """The level that with a confidence is passed at least that often; u at least."""
        inside = self.deviance <= quantile**2
        ratio = np.full(int(np.count_nonzero(inside)), self.rate_per_hour / rate_per_hour)
        return float(np.min(_level(self.shapes[inside], self.scales[inside], ratio))) + self.level

    def level_at(self, rate_per_hour: float) -> float:
        """The level that is likeliest to be passed that often; u at least,"""
        ratio = np.array([self.rate_per_hour / rate_per_hour])
        return self.level + float(_level(np.array([self.shape]), np.array([self.scale]), ratio)[0])

    def shape_interval(self, quantile: float) -> tuple[float, float]:
        """Shapes that the deviance leaves room for."""
        inside = self.deviance <= quantile**2
        return float(self.shapes[inside].min()), float(self.shapes[inside].max())

    def _rates(self, quantile: float, times: float = 1.0) -> tuple[FloatArray, np.ndarray]:
        """For the points of the grid inside the bound: the largest lambda there, and which points they are."""
        room = quantile**2 / times - self.deviance
        inside = np.flatnonzero(room >= 0.0)
        ratio = np.interp(self.count_dispersion * room[inside] / (2.0 * self.peaks), _ROOM, _RATIO, left=1.0)
        return self.rate_per_hour * ratio, inside


def tail_likelihood(
    excess: FloatArray, level: float, hours: float, dispersion: tuple[float, float], quantile: float = 3.0
) -> TailLikelihood:
    """The likelihood of a tail.

    Args:
        excess: (k,) how far the peaks exceed u, above 0.
        level: u.
        hours: time they were seen in.
        dispersion: of the counts and of the sizes, 1 at least.
        quantile: the largest that bounds will be asked for; the grid reaches so far.
    """
    k = excess.size
    mean = float(np.mean(excess))
    reach = min(3.0, 1.5 * quantile * float(np.sqrt(dispersion[1] * 2.0 / k)) + 0.2)
    spread = np.exp(np.linspace(-reach, reach, _SCALES))
    shapes = np.repeat(_SHAPES, _SCALES)
    # Where the shape is negative the law ends at sigma / -xi, beyond the largest peak.
    least = np.where(shapes < 0, -shapes * float(np.max(excess)) * (1 + _TINY), 0.0)
    scales = np.maximum(np.outer(mean * (1.0 - _SHAPES).clip(0.4), spread).ravel(), least)
    likelihood = _log_likelihood(excess, shapes, scales) / dispersion[1] - 0.5 * ((shapes - SHAPE_MEAN) / SHAPE_SD) ** 2
    light = shapes <= _TINY
    heavy_tail = 2.0 * (np.max(likelihood) - np.max(likelihood[light])) > _HEAVIER
    if not heavy_tail:
        shapes, scales, likelihood = shapes[light], scales[light], likelihood[light]
    best = int(np.argmax(likelihood))
    deviance = 2.0 * (likelihood[best] - likelihood)
    return TailLikelihood(
        level,
        float(scales[best]),
        float(shapes[best]),
        k / hours,
        k,
        bool(heavy_tail),
        dispersion[0],
        scales,
        shapes,
        np.asarray(deviance, dtype=np.float64),
    )


def _log_likelihood(excess: FloatArray, shapes: FloatArray, scales: FloatArray) -> FloatArray:
    """(g,) of the generalised Pareto law at each point."""
    out = np.empty(shapes.size)
    for part in np.array_split(np.arange(shapes.size), max(1, shapes.size * excess.size // 1_000_000)):
        xi, sigma = shapes[part, None], scales[part, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            inner = np.log(np.maximum(1.0 + xi * excess[None, :] / sigma, 1e-300))
            total = np.where(np.abs(xi[:, 0]) < _TINY, (excess[None, :] / sigma).sum(axis=1), 0.0)
            slope = np.where(np.abs(xi) < _TINY, 0.0, 1.0 + 1.0 / np.where(np.abs(xi) < _TINY, 1.0, xi))
        out[part] = -excess.size * np.log(sigma[:, 0]) - (slope * inner).sum(axis=1) - total
    return out


def _survival(shapes: FloatArray, scales: FloatArray, excess: float) -> FloatArray:
    """(g,) share of peaks that exceed u by more than ``excess``."""
    x = max(0.0, excess) / scales
    small = np.abs(shapes) < _TINY
    inner = np.maximum(1.0 + shapes * x, 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(small, np.exp(-x), inner ** (-1.0 / np.where(small, 1.0, shapes))))


def _level(shapes: FloatArray, scales: FloatArray, ratio: FloatArray) -> FloatArray:
    """(g,) excess over u that is passed once in ``ratio`` peaks; 0 where the ratio is below one."""
    log_ratio = np.log(np.maximum(ratio, 1.0))
    small = np.abs(shapes) < _TINY
    return np.asarray(scales * np.where(small, log_ratio, np.expm1(shapes * log_ratio) / np.where(small, 1.0, shapes)))
