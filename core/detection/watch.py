"""Which joints are judged: position-controlled ones, not those that give way to a commanded force."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.errors import ConfigError, did_you_mean
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.runs import run_bounds
from collaudit.core.numeric.stats import median_of

#: A joint in contact that reverses more often a second, over smaller strokes (rad; m if prismatic), is taken as
#: controlled by force: the paper's joints 2 to 5 do while they polish.
_REVERSALS_PER_S, _REVERSAL_STROKE = 0.5, 0.02
#: Strokes shorter than this are encoder noise of a standing joint, rad.
_NOISE_STROKE = 2e-4


@dataclass(frozen=True, slots=True)
class Watch:
    """Whether and where one joint is judged.

    Attributes:
        watched: whether it is judged at all.
        in_contact: whether it is judged during contact.
        why: the reason, for a reader.
    """

    watched: bool
    in_contact: bool
    why: str


def choose_watched(series: UniformSeries, contact: BoolArray, config: DetectConfig) -> dict[str, Watch]:
    """Decide by joint.

    With ``watch = "auto"`` every joint is judged, except during contact those that reverse often over
    small strokes: friction at reversal cannot be modelled well, and their motion obeys the force (the
    paper's joints 2-5). A list of names overrides this.

    Raises:
        ConfigError: a named joint is not in the log.
    """
    if config.watch != "auto":
        return _named(series.joint_names, config.watch)
    out = {}
    for j, joint in enumerate(series.joint_names):
        rate, stroke = _reversals(series.position_rad[:, j], series.velocity_rad_s[:, j], contact, series.period_s)
        if rate > _REVERSALS_PER_S and stroke < _REVERSAL_STROKE:
            why = (
                f"force-controlled in contact: {rate:.2g} reversals a second over strokes of {stroke:.2g} rad "
                "(median); friction at reversal hides what its residual would show"
            )
            out[joint] = Watch(True, False, why)
        else:
            out[joint] = Watch(
                True, True, "position-controlled throughout" if contact.any() else "every joint is watched"
            )
    return _lumped(out, series.joint_names)


def _lumped(choice: dict[str, Watch], joints: tuple[str, ...]) -> dict[str, Watch]:
    """The paper's reduction: runs of force-controlled joints become one body seen by the joint inside of it."""
    forced = [not choice[joint].in_contact for joint in joints]
    starts, stops = run_bounds(np.array(forced))
    for a, b in zip(starts, stops, strict=True):
        names = f"{joints[a]} to {joints[b - 1]}" if b - a > 1 else joints[a]
        if a == 0:
            text = f"no position-controlled joint lies inside of {names}: in contact, pushes there cannot be seen"
        else:
            watcher, inner = joints[a - 1], choice[joints[a - 1]]
            text = f"in contact the links of {names} count as one body, and {watcher}, position-controlled, watches it"
            choice[watcher] = replace(inner, why=f"{inner.why}; in contact it also watches the links of {names}")
        for joint in joints[a:b]:
            choice[joint] = replace(choice[joint], why=f"{choice[joint].why}; {text}")
    return choice


def _named(joints: tuple[str, ...], names: list[str]) -> dict[str, Watch]:
    missing = [name for name in names if name not in joints]
    if missing:
        raise ConfigError(
            "a watched joint is not among the judged joints",
            where="[detect] watch",
            found=", ".join(missing),
            expected="some of " + ", ".join(joints),
            hint=did_you_mean(missing[0], joints),
        )
    return {
        joint: Watch(True, True, "named in [detect] watch")
        if joint in names
        else Watch(False, False, "not named in [detect] watch")
        for joint in joints
    }


def _reversals(q: FloatArray, v: FloatArray, contact: BoolArray, period_s: float) -> tuple[float, float]:
    """Reversals a second and median stroke between them, rad, over the contact phases."""
    if not contact.any():
        return 0.0, 0.0
    count, strokes, seconds = 0, [], 0.0
    starts, stops = run_bounds(contact & np.isfinite(q) & np.isfinite(v))
    for a, b in zip(starts, stops, strict=True):
        forward, backward = v[a:b] > 0, v[a:b] < 0
        turns = np.flatnonzero(forward[1:] & backward[:-1] | backward[1:] & forward[:-1]) + a
        stroke = np.abs(np.diff(q[turns]))
        stroke = stroke[stroke > _NOISE_STROKE]
        count += stroke.size
        strokes.append(stroke)
        seconds += (b - a) * period_s
    if count == 0 or seconds == 0:
        return 0.0, 0.0
    return count / seconds, median_of(np.concatenate(strokes))
