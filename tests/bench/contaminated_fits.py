"""What contact inside the fitting log does to friction and what it leaves: ``python contaminated_fits.py LOGS [PAGE]``.

To a minute of free motion of each simulated arm, ten seeds, torque is added for 5 to 40 % of the time: short pushes of
0.2 to 1 s, holds that come every 3 s, one clamp that lasts; on one joint (a tenth to a quarter of its rated torque) or
as J^T f of 40 to 100 N on a link. Friction is fitted on each log, and compared with the fit of the same log without.
LOGS is a folder where the logs are kept; PAGE is the page whose table ``contaminated-fits`` is replaced.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from tables import put

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.dataclass import dataclass
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.joint_fits import fit_joints
from collaudit.core.friction.motion_points import motion_samples
from collaudit.core.identification.log_cleaning import cleaned
from collaudit.core.numeric.allocator import one_thread_of_linear_algebra
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.stats import quantile_of, robust_sd
from collaudit.core.prepare.prepared import Prepared, _modelled
from collaudit.fixtures.simulation import simulate_to

ARMS, SEEDS = ("paper6", "seven"), range(1, 11)
KINDS, SHARES = ("short", "held", "clamp"), (0.05, 0.1, 0.2, 0.3, 0.4)
_RAMP_S, _EVERY_S, _LONGEST_S = 0.1, 3.0, 1.0
#: Of a joint's rated torque; N on a link.
_RATED, _FORCE_N = (0.1, 0.25), (40.0, 100.0)
#: Friction may differ by this from the fit without contact; what it leaves may be so many times as much.
FRICTION, SPREAD = 0.05, 1.3


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """One log's fit.

    Attributes:
        share: of the motion left out; refused: nothing was fitted.
        joints: friction.
        left: by joint robust SD and 99.9 % quantile of what friction leaves in settled motion, N·m.
    """

    share: float
    refused: bool
    joints: dict[str, FrictionFit]
    left: dict[str, tuple[float, float]]


def opened(folder: Path, arm: str, seed: int) -> tuple[Prepared, LoadedConfig]:
    """A minute of free motion, made unless it is there."""
    log = folder / f"{arm}-free-clean-{seed}.mcap"
    if not log.with_suffix(".toml").exists():
        folder.mkdir(parents=True, exist_ok=True)
        simulate_to("free-clean", arm, seed, "mcap", log, duration_s=60.0)
    settings = load_config(log.with_suffix(".toml"))
    return api.prepare(log, settings), settings


def shape(kind: str, share: float, time_s: FloatArray, rng: np.random.Generator) -> FloatArray:
    """(n,) size of the contact from -1 to 1, for this share of the time."""
    t = time_s - time_s[0]
    out = np.zeros(t.size)
    if kind == "held":
        return trapezoid(t % _EVERY_S, share * _EVERY_S)
    if kind == "clamp":
        return trapezoid(t - rng.uniform(0.0, 1.0 - share) * t[-1], share * t[-1])
    while np.mean(out != 0) < share:
        start, length = rng.uniform(0.0, t[-1] - _LONGEST_S), rng.uniform(0.2, _LONGEST_S)
        if not out[(t > start - _RAMP_S) & (t < start + length + _RAMP_S)].any():
            out += rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.0) * trapezoid(t - start, length)
    return out


def trapezoid(t: FloatArray, length: float) -> FloatArray:
    """(n,) 1 between 0 and a length, with ramps; 0 elsewhere."""
    return np.asarray(np.clip(np.minimum(t, length - t) / min(_RAMP_S, length / 3), 0.0, 1.0))


def contaminated(log: Prepared, settings: LoadedConfig, kind: str, share: float, on: str, seed: int) -> Prepared:
    """The log with contact on one joint or on a link, drawn by the seed."""
    rng = np.random.default_rng([seed, *kind.encode(), *on.encode(), round(100 * share)])
    series, robot = log.start.series, log.robot
    assert series.effort is not None
    size = shape(kind, share, series.time_s, rng)
    effort, joints = series.effort.copy(order="F"), series.effort.shape[1]
    if on == "joint":
        j = int(rng.integers(joints))
        effort[:, j] += size * rng.choice([-1.0, 1.0]) * rng.uniform(*_RATED) * robot.effort_limit_nm[j]
    else:
        link = robot.link_of(series.joint_names[int(rng.integers(2, joints))])
        force = rng.standard_normal(3)
        wrench = np.zeros((size.size, 6))
        wrench[:, :3] = force * rng.uniform(*_FORCE_N) / np.linalg.norm(force)
        effort += size[:, None] * np.nan_to_num(robot.wrench_torque(series.position_rad, wrench, str(link)))
    start = replace(log.start, series=replace(series, effort=effort))
    return _modelled(start, log.calibration, settings.config, None)


def fitted(log: Prepared, settings: LoadedConfig) -> Fitted:
    """Friction without contact as a fit finds it, and what it leaves."""
    clean = cleaned([log], settings.config)
    (facts,) = clean.left_out.values()
    if facts.refused:
        return Fitted(facts.share, True, {}, {})
    fits = fit_joints(clean.logs, settings.config)
    left = {}
    for joint, fit in fits.items():
        law, samples = FrictionModel.of(fit), motion_samples(clean.logs[0], joint)
        if law is not None and samples is not None:
            rest = samples.friction - samples.direction * law.torque(samples.direction * samples.speed)
            left[joint] = (robust_sd(rest), quantile_of(np.abs(rest), 0.999))
    return Fitted(facts.share, False, fits, left)


def against(found: Fitted, clean: Fitted) -> tuple[float, float, float]:
    """Largest difference of friction, as a share, and largest ratios of what it leaves, over the joints."""
    worst = [0.0, 0.0, 0.0]
    for joint, fit in clean.joints.items():
        right, law = FrictionModel.of(fit), FrictionModel.of(found.joints[joint])
        if right is None:
            continue
        if law is None:
            return float("inf"), float("inf"), float("inf")
        speed = np.linspace(0.1, min(right.speed_range[1], law.speed_range[1]), 30)
        off = np.max(np.abs(law.torque(speed) - right.torque(speed))) / np.mean(right.torque(speed))
        ratios = [float(a / b) for a, b in zip(found.left[joint], clean.left[joint], strict=True)]
        worst = [max(old, new) for old, new in zip(worst, (float(off), *ratios), strict=True)]
    return worst[0], worst[1], worst[2]


def rows(folder: Path, arms: tuple[str, ...] = ARMS, seeds: range = SEEDS) -> Iterator[str]:
    """The table: each row is of all seeds."""
    yield (
        "| arm | contact | of the time | refused | left out | friction off by: median, worst | SD: median, worst | "
        "99.9 %: median, worst | within limits or refused |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for arm in arms:
        logs = [(seed, *opened(folder, arm, seed)) for seed in seeds]
        clean = {seed: fitted(log, settings) for seed, log, settings in logs}
        most, refused = max(one.share for one in clean.values()), sum(one.refused for one in clean.values())
        yield f"| {arm} | none | 0 % | {refused} | {100 * most:.1f} % | | | | |"
        for kind in KINDS:
            for share in SHARES:
                found = [
                    (clean[seed], fitted(contaminated(log, settings, kind, share, on, seed), settings))
                    for seed, log, settings in logs
                    for on in ("joint", "link")
                ]
                yield row(f"| {arm} | {kind} | {100 * share:.0f} %", found)


def row(first: str, found: list[tuple[Fitted, Fitted]]) -> str:
    """One row of the table."""
    kept = [(log.share, *against(log, clean)) for clean, log in found if not log.refused]
    refused = len(found) - len(kept)
    if not kept:
        return f"{first} | {refused} | | | | | {refused} of {len(found)} |"
    share, off, sd, tail = np.array(kept).T
    good = int(np.count_nonzero((off <= FRICTION) & (sd <= SPREAD) & (tail <= SPREAD))) + refused
    return (
        f"{first} | {refused} | {100 * np.median(share):.0f} % | {100 * np.median(off):.1f}, {100 * off.max():.1f} % | "
        f"{np.median(sd):.2f}, {sd.max():.2f} | {np.median(tail):.2f}, {tail.max():.2f} | {good} of {len(found)} |"
    )


def main(folder: Path, page: Path | None) -> None:
    """Print the table; put it into the page when one is given."""
    lines = []
    for line in rows(folder):
        print(line, flush=True)
        lines.append(line)
    if page is not None:
        put(page, "contaminated-fits", lines)


if __name__ == "__main__":
    one_thread_of_linear_algebra()
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
