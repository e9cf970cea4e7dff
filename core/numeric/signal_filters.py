"""The functions of ``scipy.signal`` that a log needs, without its import, which takes longer than a minute of log.

``scipy.signal`` loads most of SciPy, 0.7 to 1.4 s of every command. Its compiled recursion is loaded alone, and by the
public way where SciPy has moved it; the rest are formulas of a few lines. Each is tested against the public function.
"""

from __future__ import annotations

import functools
import importlib.util
from importlib.machinery import PathFinder
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray

_RECURSION, _FUNCTION = "_sigtools", "_linear_filter"


def lfilter(b: FloatArray, a: FloatArray, x: FloatArray, zi: FloatArray) -> FloatArray:
    """(n, j) result of a recursive filter along the columns: ``scipy.signal.lfilter`` with ``axis=0``.

    Args:
        b, a: numerator and denominator in z.
        x: (n, j).
        zi: (m, j) state before the first row.
    """
    return np.asarray(_recursion()(b, a, x, 0, zi)[0])


def filtfilt(b: FloatArray, a: FloatArray, x: FloatArray, padlen: int) -> FloatArray:
    """(n, j) result of a filter run forward and backward: ``scipy.signal.filtfilt`` with ``axis=0``.

    Args:
        b, a: numerator and denominator in z.
        x: (n, j).
        padlen: rows by which both ends are continued by point reflection, less than n.
    """
    before = 2.0 * x[:1] - x[padlen:0:-1]
    after = 2.0 * x[-1:] - x[-2 : -padlen - 2 : -1]
    whole = np.concatenate((before, x, after)) if padlen else x
    settled = lfilter_zi(b, a)[:, None]
    forward = lfilter(b, a, whole, settled * whole[:1])
    both = lfilter(b, a, forward[::-1], settled * forward[-1:])[::-1]
    return both[padlen : padlen + len(x)]


def lfilter_zi(b: FloatArray, a: FloatArray) -> FloatArray:
    """(m,) state of a filter whose input has been 1 for ever: ``scipy.signal.lfilter_zi``.

    It solves z = A z + B with A the transposed companion matrix of the denominator and B = b_k - a_k b_0.
    """
    size = max(b.size, a.size)
    b, a = (np.concatenate([x / a[0], np.zeros(size - x.size)]) for x in (b, a))
    companion = np.eye(size - 1, k=-1)
    companion[0] = -a[1:]
    return np.asarray(np.linalg.solve(np.eye(size - 1) - companion.T, b[1:] - a[1:] * b[0]))


def butterworth(corner: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator (3,) of the second-order low-pass: ``scipy.signal.butter(2, corner)``.

    Poles of the prototype at exp(±3πi/4), scaled to the warped corner, and the bilinear transform (A. V. Oppenheim,
    R. W. Schafer, *Discrete-Time Signal Processing*, ch. 7).

    Args:
        corner: -3 dB frequency as a share of half the sample rate, above 0 and below 1.
    """
    warped = 4.0 * np.tan(np.pi * corner / 2.0)
    poles = warped * -np.exp(1j * np.pi * np.array([-1.0, 1.0]) / 4.0)
    gain = warped**2 * np.real(1.0 / np.prod(4.0 - poles))
    return np.asarray(gain * np.array([1.0, 2.0, 1.0])), np.real(np.poly((4.0 + poles) / (4.0 - poles)))


def first_order_hold(numerator: FloatArray, denominator: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray]:
    """A filter in s as one in z, exact for inputs that are straight between samples: ``cont2discrete``, ``foh``.

    The state space in controller canonical form, and the exponential of its block matrix (G. F. Franklin, J. D.
    Powell, M. L. Workman, *Digital Control of Dynamic Systems*, 6.3.2).

    Args:
        numerator, denominator: of the filter in s, highest power first, the numerator at most as long.
        period_s: sample period, s.
    """
    den = denominator / denominator[0]
    num = np.concatenate([np.zeros(den.size - numerator.size), numerator / denominator[0]])
    order = den.size - 1
    block = np.zeros((order + 2, order + 2))
    block[:order, :order] = np.eye(order, k=-1)
    block[0, :order] = -den[1:]
    block[0, order] = 1.0
    block *= period_s
    block[order, order + 1] = 1.0
    power = _exponential(block)
    a, before, after = power[:order, :order], power[:order, order], power[:order, order + 1]
    b = before - after + a @ after
    c = num[1:] - num[0] * den[1:]
    discrete = np.asarray(np.poly(a), dtype=np.float64)
    return np.asarray(np.poly(a - np.outer(b, c)) + (num[0] + c @ after - 1.0) * discrete), discrete


def _exponential(a: FloatArray) -> FloatArray:
    """(n, n) exponential of a small matrix: the power series of a part of it below 1/16, squared so many times."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.abs(a).sum(axis=1).max()), 1e-300)))) + 4)
    term = total = np.eye(len(a))
    for k in range(1, 14):
        term = term @ a / (2.0**halvings * k)
        total = total + term
    return np.asarray(np.linalg.matrix_power(total, 2**halvings))


@functools.cache
def _recursion() -> Any:
    """The compiled recursion: (b, a, x, axis, state before) -> (result, state after)."""
    package = importlib.util.find_spec("scipy")
    folders = [f"{folder}/signal" for folder in (package and package.submodule_search_locations) or ()]
    spec = PathFinder.find_spec(_RECURSION, folders)
    if spec is not None and spec.loader is not None:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        if hasattr(module, _FUNCTION):
            return getattr(module, _FUNCTION)
    from scipy.signal import lfilter as public

    return lambda b, a, x, axis, zi: public(b, a, x, axis=axis, zi=zi)
