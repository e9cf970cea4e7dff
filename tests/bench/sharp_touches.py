"""Labelled touches of a resting arm with joint-side sensors, as recorded and at a quarter (part ``touches``)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from changed_logs import judged, named
from real_log_list import TOUCH_LOGS

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError

#: A touch is asked for when it exceeds so many robust SD of the quiet torque for so many samples.
_SD, _SAMPLES = 6.0, 5
#: A contact this far from a label is of its touch, s, and half of it is no quiet time: a person set the label.
_AROUND_S = 0.5
#: Quiet torque before and after a touch from which its level is taken, s.
_LEVEL_S = 0.3
Spans = list[tuple[float, float]]


def measure(asked: Any, known: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each file as it is, with its touches at a quarter, and the same with the noise that this takes given back."""
    for number, log in enumerate(TOUCH_LOGS):
        if log.name in known or (asked.logs and log.name not in asked.logs):
            continue
        settings = log.settings(asked.data, asked.work, "sharpest")
        read = api.open_log(log.files(asked.data, asked.work), settings)
        try:
            friction: FrictionFile | None = api.fit([log.files(asked.data, asked.work)], settings)
        except CollauditError:
            friction = None  # at rest there is nothing to fit
        (label,) = (one for one in read.annotations if one.name == "label")
        rng = np.random.default_rng([asked.seed, number])
        logs = {
            "as recorded": read,
            "a quarter": scaled(read, label.intervals_s, 0.25, None),
            "a quarter, noise kept": scaled(read, label.intervals_s, 0.25, rng),
        }
        yield log.name, {name: counted(one, label.intervals_s, settings, friction) for name, one in logs.items()}


def quiet(log: JointLog, spans: Spans) -> np.ndarray:
    """(n,) samples away from the labels."""
    out = np.ones(log.time_s.size, dtype=bool)
    for start, end in spans:
        out[(log.time_s > start - _AROUND_S / 2) & (log.time_s < end + _AROUND_S / 2)] = False
    return out


def scaled(log: JointLog, spans: Spans, factor: float, rng: np.random.Generator | None) -> JointLog:
    """In touches: the quiet level, and a share of what differs from it; with ``rng`` noise of full size.

    A touch begins a little before a person marks it, and ends after: what is scaled reaches as far as :func:`quiet`
    leaves out.
    """
    assert log.effort is not None
    effort, calm = log.effort.copy(), quiet(log, spans)
    noise = effort[calm] - np.median(effort[calm], axis=0)
    edges = np.flatnonzero(np.diff(np.r_[False, ~calm, False].astype(np.int8)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        start, end = log.time_s[first], log.time_s[last - 1]
        ends = []
        for a, b in ((start - _LEVEL_S, start), (end, end + _LEVEL_S)):
            near = calm & (log.time_s >= a) & (log.time_s <= b)
            ends.append(np.median(effort[near if near.any() else calm], axis=0))
        inside = slice(first, last)
        share = ((log.time_s[inside] - start) / max(end - start, 1e-9))[:, None]
        level = (1.0 - share) * ends[0] + share * ends[1]
        effort[inside] = level + factor * (log.effort[inside] - level)
        if rng is not None:
            at = int(rng.integers(0, max(1, len(noise) - last + first)))
            own = np.resize(noise[at : at + last - first], (last - first, noise.shape[1]))
            effort[inside] += np.sqrt(1.0 - factor**2) * (own - own.mean(axis=0))
    return named(replace(log, effort=effort), f"times {factor:g} {rng is not None}")


def counted(log: JointLog, spans: Spans, settings: LoadedConfig, friction: FrictionFile | None) -> dict[str, Any]:
    """Touches that still stand out, those found, contacts at no label, and the delay of those found."""
    assert log.effort is not None
    calm = quiet(log, spans)
    centre = np.median(log.effort[calm], axis=0)
    sd = 1.4826 * np.median(np.abs(log.effort[calm] - centre), axis=0)
    out = np.abs(log.effort - centre) > _SD * sd
    result = judged(log, settings, friction).result
    alarms = [(one.onset_s, one.onset_s + one.duration_s, one.detected_s) for one in result.collisions]
    asked = found = found_of_asked = 0
    delays = []
    for start, end in spans:
        inside = (log.time_s >= start) & (log.time_s <= end)
        stands_out = any(_run(out[inside, j]) >= _SAMPLES for j in range(out.shape[1]))
        hits = [detected for a, b, detected in alarms if a < end + _AROUND_S / 2 and b > start - _AROUND_S / 2]
        asked += stands_out
        found += bool(hits)
        found_of_asked += bool(hits) and stands_out
        delays += [min(hits) - start] if hits else []
    false = sum(
        not any(one.onset_s < end + _AROUND_S and one.end_s > start - _AROUND_S for start, end in spans)
        for one in result.contacts
    )
    noise = dict(zip(log.joint_names, sd.tolist(), strict=True))
    return {
        "touches": len(spans), "found": found, "stand_out": asked, "found_of_those": found_of_asked, "false": false,
        "delays_s": delays, "contacts": len(result.contacts), "sd_nm": noise, "gamma_nm": dict(result.rule.gamma_nm),
    }  # fmt: skip


def _run(values: np.ndarray) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, values, False].astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def tables(found: Mapping[str, Any], before: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """One row a way of scaling, over all files; gamma beside the noise."""
    lines = ["| touches | found | of those above 6 robust SD | at no touch | median delay | before: found, above 6 |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for kind in ("as recorded", "a quarter", "a quarter, noise kept"):
        now, old = (_total([its[kind] for its in of.values() if kind in its]) for of in (found, before))
        if now:
            was = "–" if not old else f"{old[0]}, {old[1]}"
            lines.append(f"| {kind} | {now[0]} | {now[1]} | {now[2]} | {now[3]} | {was} |")
    yield "touches", lines
    plain = [its["as recorded"] for its in found.values()]
    earlier = [its["as recorded"] for its in before.values()]
    lines = ["| joint | quiet torque, robust SD, N·m | γ, N·m | γ before |", "|---|---|---|---|"]
    for joint in plain[0]["sd_nm"] if plain else ():
        sd, gamma = (np.median([one[key].get(joint, np.nan) for one in plain]) for key in ("sd_nm", "gamma_nm"))
        was = np.median([one["gamma_nm"].get(joint, np.nan) for one in earlier]) if earlier else np.nan
        lines.append(f"| {joint} | {sd:.3g} | {gamma:.3g} | {'–' if np.isnan(was) else format(was, '.3g')} |")
    yield "touches-gamma", lines


def _total(its: list[Mapping[str, Any]]) -> tuple[str, str, int, str] | None:
    if not its:
        return None
    count, found, asked, both, false = (
        sum(one[key] for one in its) for key in ("touches", "found", "stand_out", "found_of_those", "false")
    )
    delays = [x for one in its for x in one["delays_s"]]
    share = f"{both} of {asked} ({100 * both / asked:.0f} %)" if asked else "–"
    return f"{found} of {count}", share, false, f"{1000 * np.median(delays):.0f} ms" if delays else "–"
