"""Faults of clocks and recorders, and settings and friction files that do not fit, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from faulty_case import PUSH_NM, PUSH_S, Signals
from signal_faults import Named

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit


def _keep(s: Signals, rows: np.ndarray) -> None:
    s.t, s.q, s.dq, s.tau = s.t[rows], s.q[rows], s.dq[rows], s.tau[rows]


def clocks() -> Named:
    def rate(s: Signals, factor: float) -> None:
        s.t = s.t * factor

    for factor in (1e-3, 0.5, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25, 2.0, 10.0, 60.0, 1000.0):
        yield f"clock-times-{factor:g}", partial(rate, factor=factor)

    def jump(s: Signals, by: float, at: float) -> None:
        s.t[s.rows(at, 99)] += by

    for by in (0.05, 1.0, 60.0, 1e6, -0.1, -1.0, -5.0):
        for at in (5.0, 9.15):
            yield f"clock-jumps-{by:g}s-at-{at:g}s", partial(jump, by=by, at=at)

    def jitter(s: Signals, sd: float) -> None:
        s.t = np.sort(s.t + np.random.default_rng(8).normal(0, sd, s.t.size))

    for sd in (1e-4, 1e-3, 1e-2, 5e-2):
        yield f"clock-jitter-{sd:g}s", partial(jitter, sd=sd)

    def odd(s: Signals, value: float) -> None:
        s.t[s.rows(*PUSH_S)] = value

    for value in (np.nan, np.inf, 0.0, -1.0, 2.0**31, 2.0**32, 1e18):
        yield f"stamps-{value:g}-in-push", partial(odd, value=value)

    def backwards(s: Signals) -> None:
        s.t = s.t[::-1].copy()

    yield "clock-backwards", backwards

    def coarse(s: Signals, step: float) -> None:
        s.t = np.floor(s.t / step) * step

    for step in (0.01, 0.1, 1.0):
        yield f"stamps-in-steps-of-{step:g}s", partial(coarse, step=step)


def recorders() -> Named:
    def lost(s: Signals, share: float) -> None:
        _keep(s, np.flatnonzero(np.random.default_rng(9).random(s.t.size) >= share))

    for share in (0.01, 0.1, 0.3, 0.5, 0.8, 0.95):
        yield f"rows-lost-{share:g}", partial(lost, share=share)

    def gap(s: Signals, length: float) -> None:
        middle = sum(PUSH_S) / 2
        _keep(s, np.flatnonzero(np.abs(s.t - middle) > length / 2))

    for length in (0.3, 0.5, 1.0, 3.0, 6.0):
        yield f"gap-{length:g}s-at-push", partial(gap, length=length)

    def cut(s: Signals, at: float) -> None:
        _keep(s, np.flatnonzero(s.t < at))

    for at in (0.5, 2.0, 8.9, 9.15):
        yield f"cut-at-{at:g}s", partial(cut, at=at)

    def publishers(s: Signals, first: bool, offset: float) -> None:
        calm = s.tau.copy()
        calm[s.rows(*PUSH_S), 0] -= PUSH_NM
        pair = (s.tau, calm) if first else (calm, s.tau)
        shape = (2 * s.t.size, 2)
        s.tau = np.stack(pair, axis=1).reshape(shape)
        s.t = np.stack([s.t, s.t + offset], axis=1).ravel()
        s.q, s.dq = np.repeat(s.q, 2, axis=0), np.repeat(s.dq, 2, axis=0)

    for offset in (0.0, 1e-9, 1e-4, 2e-3):
        for first in (True, False):
            yield (
                f"two-publishers-{offset:g}s-push-{'first' if first else 'second'}",
                partial(publishers, first=first, offset=offset),
            )

    def doubled(s: Signals, times: int) -> None:
        s.t, s.q, s.dq, s.tau = (np.repeat(x, times, axis=0) for x in (s.t, s.q, s.dq, s.tau))

    for times in (2, 5):
        yield f"every-row-{times}-times", partial(doubled, times=times)

    def slow(s: Signals, every: int) -> None:
        _keep(s, np.arange(0, s.t.size, every))

    for every in (5, 25, 50, 125, 250):
        yield f"one-row-of-{every}", partial(slow, every=every)

    def again(s: Signals) -> None:
        s.t = np.concatenate([s.t, s.t])
        s.q, s.dq, s.tau = (np.concatenate([x, x]) for x in (s.q, s.dq, s.tau))

    yield "the-log-twice", again


_SETTINGS: dict[str, list[object]] = {
    "detect.gamma_nm": [5.0, 11.0, 13.0, 20.0, 30.0, 100.0, 1e4, 1e9, 1e308],
    "detect.n": [1, 10, 50, 74, 76, 100, 250, 251, 500, 3999, 5000, 10**9, 10**18],
    "detect.watch": [["joint2"]],
    "detect.observer_gain_per_s": [1e-9, 1.0],
    "detect.detector": ["momentum", "filtered", "eso"],
    "detect.causal": [True],
    "conditioning.bandwidth_hz": [1e-6, 0.1, 1.0, 5.0, 124.0],
    "conditioning.velocity": ["position", "logged"],
    "robot.tool": [{"mass_kg": 1.0}, {"mass_kg": 5.0}, {"mass_kg": 50.0}, {"mass_kg": 1.0, "com_m": [0, 0, 5.0]}],
    "robot.base_rpy_deg": [[0, 0, 0], [90, 0, 180], [-90, 0, 0]],
    "robot.armature_kg_m2": [[1.0, 1.0], [100.0, 100.0]],
    "log.effort_delay_ms": [50.0, -500.0],
    "policy.max_collisions": [5],
    "policy.observable_nm": [0.01, 1e6],
    "policy.min_coverage": [1.0],
    "near_miss.amplitude": [0.01],
}


def settings() -> Named:
    def stated(s: Signals, key: str, value: object) -> None:
        s.settings[key] = value

    for key, values in _SETTINGS.items():
        for number, value in enumerate(values):
            yield f"{key}-{number}", partial(stated, key=key, value=value)


def friction_files() -> Named:
    def using(s: Signals, change: Callable[[FrictionFile], FrictionFile]) -> None:
        s.friction = change

    def fits(change: Callable[[FrictionFit], FrictionFit]) -> Callable[[FrictionFile], FrictionFile]:
        return lambda file: replace(file, joints={name: change(fit) for name, fit in file.joints.items()})

    def scaled(fit: FrictionFit, factor: float) -> FrictionFit:
        values = {k: v * factor if k in ("A_nm", "B_nm", "D_nm_s_per_rad") else v for k, v in fit.parameters.items()}
        return replace(fit, parameters=values)

    for unit in ("A", "raw", "mN·m", ""):
        yield f"friction-in-{unit or 'no-unit'}", partial(using, change=fits(partial(replace, effort_unit=unit)))
    for factor in (-1.0, 0.0, 0.1, 3.0, 10.0, 1000.0):
        yield f"friction-times-{factor:g}", partial(using, change=fits(partial(scaled, factor=factor)))

    def renamed(file: FrictionFile) -> FrictionFile:
        return replace(file, joints={f"other_{name}": fit for name, fit in file.joints.items()})

    def without(file: FrictionFile, joint: str) -> FrictionFile:
        return replace(file, joints={name: fit for name, fit in file.joints.items() if name != joint})

    def swapped(file: FrictionFile) -> FrictionFile:
        return replace(file, joints=dict(zip(file.joints, reversed(file.joints.values()), strict=True)))

    def foreign(file: FrictionFile) -> FrictionFile:
        return replace(file, provenance=replace(file.provenance, model_sha256="f" * 64))

    yield "friction-of-other-joints", partial(using, change=renamed)
    yield "friction-lacks-joint1", partial(using, change=partial(without, joint="joint1"))
    yield "friction-lacks-joint2", partial(using, change=partial(without, joint="joint2"))
    yield "friction-of-joints-swapped", partial(using, change=swapped)
    yield "friction-of-another-robot", partial(using, change=foreign)
    yield "friction-of-no-law", partial(using, change=fits(lambda fit: replace(fit, model=None)))
