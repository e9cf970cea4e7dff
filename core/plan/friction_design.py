"""What points of friction at given speeds tell of a law's parameters: Fisher information, and half widths.

For a point f with standard deviation s at speed v the information is g gᵀ / s², g the derivative of the curve by the
parameters (Atkinson, Donev and Tobias, Optimum Experimental Designs, 2007); s² falls with the time at that speed, but
for what points scatter beyond their blocks. Where a law is not determined yet, its rate could be many: the information
is looked at for several, and the mean of the criterion counts (Bayesian design: Chaloner and Verdinelli, Statistical
Science 10, 1995).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit as student_quantile

from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction import least_squares as ls
from collaudit.core.friction.friction_model import FrictionModel, curve_gradient
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction.law_comparison import with_scatter
from collaudit.core.friction_laws.friction_law import FrictionLaw, SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS, LINE, REFERENCE
from collaudit.core.numeric.arrays import FloatArray

#: Rates, s/rad, at which extra friction near standstill fades; gears lie between.
_RATES = (8.0, 20.0, 50.0)
#: Extra friction near standstill that fades, as a share of what stays, where it is not known.
_FADING = 0.25
#: Of a joint's highest torque: Coulomb friction where nothing was measured, and the error of a point.
_UNKNOWN_LEVEL, _UNKNOWN_SD = 0.05, 0.001
#: Points scatter so many times more than blocks within them do (seed 1 of the six-axis arm; the table of docs/plan.md
#: has other seeds), and how many degrees of freedom this is worth; parameters of a law, which take some.
_BEYOND, _EXPECTED, _FREE = 1.2, 5, 4
_LEAST_LEFT = 1e-9  # of the variances, below which rounding counts
_LEAST_KNOWN = 1e-9  # information of every parameter without data, in units of its own size: so that all is finite


@dataclass(frozen=True, slots=True, eq=False)
class FrictionDesign:
    """What is known of one joint's friction, and what a point would add.

    Attributes:
        law: whose parameters are asked for.
        guesses: parameters by symbol; several where the rate is not known.
        known: (g, p, p) information of earlier points, for each guess.
        points: number of earlier points.
        noise: standard deviation of a point of one second, N·m, falling with the root of time.
        beyond: standard deviation that time does not lower, N·m.
        measured: whether these come from a log; else half widths mean nothing.
    """

    law: FrictionLaw
    guesses: tuple[Mapping[str, float], ...]
    known: FloatArray
    points: int
    noise: float
    beyond: float
    measured: bool

    def gradients(self, speeds: FloatArray, seconds: FloatArray) -> FloatArray:
        """(g, n, p) derivatives of the curve at speeds (n,) by the parameters, for each guess, over the points' errors.

        ``seconds``: (n,) of both ways' sections.
        """
        sd = np.hypot(self.noise / np.sqrt(seconds), self.beyond)
        return np.array([curve_gradient(self.law, values, speeds) / sd[:, None] for values in self.guesses])

    def information(self, speed: float, seconds: float) -> FloatArray:
        """(g, p, p) what one point at a speed adds."""
        g = self.gradients(np.array([speed]), np.array([seconds]))[:, 0]
        return np.asarray(g[:, :, None] * g[:, None, :])

    def gains(self, gradients: FloatArray, added: FloatArray) -> FloatArray:
        """(n,) by how much a point of each of the gradients (g, n, p) lowers the sum of the relative variances.

        The geometric mean of the guesses. A-optimal, since the widest interval is what keeps a joint from being done;
        (M + g gᵀ)⁻¹ = M⁻¹ - M⁻¹g gᵀM⁻¹ / (1 + gᵀM⁻¹g): Sherman and Morrison.
        """
        inverse = np.linalg.inv(self._whole(added))
        scaled = gradients * self._sizes()[:, None, :]
        turned = np.einsum("gnp,gpq->gnq", scaled, inverse)
        less = np.sum(turned**2, axis=2) / (1.0 + np.sum(turned * scaled, axis=2))
        before = np.log(np.trace(inverse, axis1=1, axis2=2))
        left = np.maximum(1.0 - less / np.exp(before)[:, None], _LEAST_LEFT)
        return np.asarray(np.exp(before.mean()) * (1.0 - np.exp(np.log(left).mean(axis=0))))

    def half_widths(self, added: FloatArray, count: int) -> dict[str, float]:
        """Half widths of 95 % intervals by symbol, the middle one of the guesses, with ``count`` points added."""
        freedom = max(1, self.points + count - len(self.guesses[0]))
        scale = float(student_quantile(freedom, 0.975))
        size = self._sizes()
        covariance = np.linalg.inv(self._whole(added))
        every = scale * size * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        return dict(zip(self.guesses[0], map(float, np.median(every, axis=0)), strict=True))

    def _whole(self, added: FloatArray) -> FloatArray:
        """(g, p, p) information of parameters in units of their size, so that a determinant has no units."""
        size = self._sizes()
        return np.asarray(
            (self.known + added) * size[:, :, None] * size[:, None, :] + _LEAST_KNOWN * np.eye(size.shape[1])
        )

    def _sizes(self) -> FloatArray:
        return np.array([[max(abs(x), 1e-9) for x in values.values()] for values in self.guesses])


def friction_design(fit: FrictionFit | None, torque_nm: float, fastest: float) -> FrictionDesign:
    """What is known of one joint's friction.

    Args:
        fit: of earlier logs; None for nothing.
        torque_nm: the joint's highest torque.
        fastest: speed that it will be swept at most.
    """
    if fit is None or fit.model is None or not fit.points:
        level = _UNKNOWN_LEVEL * torque_nm
        guesses = _guesses(level, level / fastest)
        empty = np.zeros((len(guesses), 4, 4))
        return FrictionDesign(REFERENCE, guesses, empty, 0, _UNKNOWN_SD * torque_nm, 0.0, False)
    law = LAWS[fit.model]
    values = {parameter_symbol(key): value for key, value in fit.parameters.items()}
    settled = fit.identifiable and isinstance(law, SeparableLaw) and law is not LINE
    if not settled:
        model = FrictionModel.of(fit)
        assert model is not None
        slow, fast = (float(f) for f in model.torque(np.array(model.speed_range)))
        slope = (fast - slow) / (model.speed_range[1] - model.speed_range[0])
        still = slow - slope * model.speed_range[0]
        law, guesses = REFERENCE, _guesses(max(still, 1e-3 * torque_nm), max(slope, 1e-3 * abs(slow) / fastest))
    else:
        guesses = (values,)
    data = with_scatter(ls.point_arrays(fit.points))
    noise, beyond = _scatter(fit, data)
    known = []
    for one in guesses:
        g = curve_gradient(law, one, data.speed) / np.hypot(data.sd, beyond)[:, None]
        known.append(g.T @ g)
    return FrictionDesign(law, guesses, np.array(known), data.n, noise, beyond, True)


def _scatter(fit: FrictionFit, data: ls.Points) -> tuple[float, float]:
    """Noise of a second and scatter beyond it of a new point, from pairs of directions, or all points without any.

    A few points hardly scatter about a law with as many parameters: what their own errors lead to expect counts beside
    them, as much as ``_EXPECTED`` degrees of freedom (a scaled inverse chi-square prior).
    """
    pairs = data.direction == 0
    rows = pairs if pairs.any() else np.ones(data.n, dtype=bool)
    own = np.array([point.se_nm for point in fit.points])[rows]
    seconds = np.array([point.seconds or 1.0 for point in fit.points])[rows]
    freedom = max(0, int(np.count_nonzero(rows)) - _FREE)
    expected = (_BEYOND**2 - 1.0) * float(np.median(own)) ** 2
    seen = max(0.0, float(np.median(data.sd[rows] ** 2)) - float(np.median(own)) ** 2)
    beyond = (freedom * seen + _EXPECTED * expected) / (freedom + _EXPECTED)
    return float(np.sqrt(np.median(own**2 * seconds))), float(np.sqrt(beyond))


def _guesses(level: float, slope: float) -> tuple[Mapping[str, float], ...]:
    """Parameters of the reference law for each of the rates, from friction near standstill and the slope."""
    return tuple({"A": level, "B": _FADING * level, "C": c, "D": slope} for c in _RATES)
