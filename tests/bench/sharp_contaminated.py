"""Friction and thresholds of fits whose log holds contact, beside the same log without (part ``contaminated``).

Contact is added as torque to simulated free motion: on the joints below a random link, by a force that is 2 to 8 times
what the clean fit's threshold of one of them is. *Short*: pushes of 0.3 s; *lasting*: one clamp; *holds*: 0.9 s each.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from changed_logs import fitted, judged, named, of_rows, prepared
from simulated_arm import ARMS, forget, settings_of, simulated

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import Audit, FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.friction.law_candidates import parameter_symbol
from collaudit.core.friction_laws.law_registry import LAWS

SHARES, KINDS = (0.05, 0.1, 0.2, 0.3, 0.4), ("short", "lasting", "holds")
LENGTH_S, EVERY, EDGE_S = 60.0, 4, 0.05
_LASTS_S = {"short": 0.3, "holds": 0.9}


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Seed after seed of both arms: all kinds and shares."""
    for seed in range(asked.seed, asked.seed + min(asked.seeds, 10)):
        for robot in ARMS:
            names = [f"{robot} {seed} {kind} {share:g}" for kind in KINDS for share in SHARES]
            if known.issuperset(names):
                continue
            folder = asked.work / "simulated"
            paths = [simulated(folder, "free-clean", seed + 500 * k, robot=robot, seconds=LENGTH_S) for k in range(2)]
            settings = settings_of(simulated(folder, "free-clean", asked.seed, robot=robot, seconds=LENGTH_S))
            clean, other = (_thinned(api.open_log((path,), settings)) for path in paths)
            usual = fitted([prepared(clean, settings)], settings)
            ready = prepared(other, settings)
            base = judged(ready, settings, usual)
            for number, name in enumerate(names):
                if name not in known:
                    rng = np.random.default_rng([seed, number])
                    kind, share = name.split()[2:]
                    yield name, of_fit(clean, other, usual, base, settings, kind, float(share), rng)
            for path in paths[seed == asked.seed :]:
                forget(path)


def _thinned(log: JointLog) -> JointLog:
    return of_rows(log, np.arange(0, log.time_s.size, EVERY), f"1 of {EVERY}")


def of_fit(
    clean: JointLog, other: JointLog, usual: FrictionFile, base: Audit, settings: LoadedConfig, kind: str,
    share: float, rng: np.random.Generator,
) -> dict[str, Any]:  # fmt: skip
    """What contact in the fitted log does to friction, gamma, and the verdict on that log and on another."""
    gamma = base.result.rule.gamma_nm
    size = np.array([gamma.get(name, np.nan) for name in clean.joint_names])
    log, spans = pressed(clean, np.nan_to_num(size, nan=2.0), kind, share, rng)
    try:
        friction = fitted([prepared(log, settings)], settings)
        same, away = (judged(one, settings, friction).result for one in (log, other))
    except CollauditError as error:
        return {"refused": error.message[:200]}
    hits = [any(c.onset_s < end and c.end_s > start for c in same.contacts) for start, end in spans]
    ratios = {
        name: away.rule.gamma_nm[name] / value
        for name, value in gamma.items()
        if np.isfinite(value) and np.isfinite(away.rule.gamma_nm.get(name, np.nan))
    }
    return {
        "friction": {name: off(fit, usual.joints[name]) for name, fit in friction.joints.items()},
        "gamma": ratios, "pushes": len(spans), "found": sum(hits), "verdict": same.verdict,
        "other_contacts": len(away.contacts), "other_verdict": away.verdict,
        "left_out": sum(one.share for one in friction.left_out.values()),
    }  # fmt: skip


def pressed(
    log: JointLog, gamma_nm: np.ndarray, kind: str, share: float, rng: np.random.Generator
) -> tuple[JointLog, list[tuple[float, float]]]:
    """The log with contact for a share of its time, and when."""
    assert log.effort is not None
    end, effort = float(log.time_s[-1]), log.effort.copy()
    if kind == "lasting":
        start = rng.uniform(0.0, end * (1.0 - share))
        spans = [(start, start + share * end)]
    else:
        every = _LASTS_S[kind] / share
        spans = [(at, at + _LASTS_S[kind]) for at in np.arange(0.5, end - every, every) + rng.uniform(0.0, 0.2)]
    for start, stop in spans:
        link = int(rng.integers(1, len(log.joint_names) + 1))
        torque = rng.uniform(-1.0, 1.0, link) * gamma_nm[:link]
        torque *= rng.uniform(2.0, 8.0) / np.abs(torque / gamma_nm[:link]).max()
        shape = np.clip(np.minimum(log.time_s - start, stop - log.time_s) / EDGE_S, 0.0, 1.0)
        effort[:, :link] += shape[:, None] * torque
    return named(replace(log, effort=effort), f"{kind} {share:g}"), spans


def off(fit: Any, usual: Any) -> float | None:
    """How far a friction curve is from the clean one over the speeds of both: RMS as a share of the curve's."""
    if fit.model is None or usual.model is None:
        return None
    low = max(fit.speed_range_rad_s[0], usual.speed_range_rad_s[0])
    speed = np.linspace(low, min(fit.speed_range_rad_s[1], usual.speed_range_rad_s[1]), 30)
    curves = []
    for one in (fit, usual):
        values = {parameter_symbol(key): value for key, value in one.parameters.items()}
        curves.append(LAWS[one.model].curve(values, speed))
    return float(np.sqrt(np.mean((curves[0] - curves[1]) ** 2) / np.mean(curves[1] ** 2)))


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row a kind and share, over arms and seeds."""
    lines = ["| contact | fits | refused | friction off: median, 95 % | γ over clean: median, 95 %, worst "
             "| pushes found in that log | it passes | contacts in a clean log | γ before: 95 %, worst |",
             "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
    groups: dict[tuple[str, str], list[Any]] = defaultdict(list)
    earlier: dict[tuple[str, str], list[Any]] = defaultdict(list)
    for of, into in ((found, groups), (before, earlier)):
        for name, its in of.items():
            into[name.split()[2], name.split()[3]].append(its)
    for (kind, share), its in sorted(groups.items()):
        fits = [one for one in its if "refused" not in one]
        friction, gamma, old = _values(fits, "friction"), _values(fits, "gamma"), _values(earlier[kind, share], "gamma")
        found_of = f"{sum(one['found'] for one in fits)} of {sum(one['pushes'] for one in fits)}"
        passes = sum(one["verdict"] == "pass" for one in fits)
        lines.append(
            f"| {kind}, {100 * float(share):.0f} % | {len(its)} | {len(its) - len(fits)} "
            f"| {_quantiles(100 * friction, (0.5, 0.95), ' %')} | {_quantiles(gamma, (0.5, 0.95, 1.0))} | {found_of} "
            f"| {passes} | {sum(one['other_contacts'] for one in fits)} | {_quantiles(old, (0.95, 1.0))} |"
        )
    yield "contaminated", lines


def _values(its: Sequence[Mapping[str, Any]], key: str) -> np.ndarray:
    return np.array([x for one in its for x in one.get(key, {}).values() if x is not None], dtype=float)


def _quantiles(values: np.ndarray, shares: Sequence[float], unit: str = "") -> str:
    return ", ".join(f"{np.quantile(values, share):.2g}{unit}" for share in shares) if values.size else "–"
