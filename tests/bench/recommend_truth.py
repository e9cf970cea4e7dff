"""How well recommended thresholds hold: bounds against the truth of 50 fresh hours, and a generator's faithfulness.

    python tests/bench/recommend_truth.py RUN... > tables.md

RUN: folders of ``collaudit detect`` on simulated clean logs of an arm, five minutes each, two dozen, with friction
files. Every other one feeds the generator, the rest is what it is compared with. All of them are logs of one arm, with
the ripple of its gears in place; where each log has it elsewhere, alarms are counted as `detect` does.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from gear_phase import in_place
from residual_generator import Made, generated, generated_peaks

from collaudit.core.data.signals import Signals, State
from collaudit.core.recommend.joint_thresholds import LOOSE, REACH, looseness, tail_evidence, threshold
from collaudit.core.recommend.sustained_levels import (
    CleanResidual,
    LogPeaks,
    SustainedPeaks,
    peaks_of_log,
    pooled_peaks,
)
from collaudit.reports.files.run_files import FRICTION_NAME, read_friction, read_run

N, TARGET = 13, 1e-3
FRESH_LOGS, RUNS = 720, 40
MOST_LOGS = 20 * 12
LAGS_S = (0.01, 0.1, 1.0, 5.0)
Peaks = list[LogPeaks]  # of the joints of one log


def peaks_of(residual: np.ndarray, clean: np.ndarray, period_s: float) -> Peaks:
    columns = range(residual.shape[1])
    return [peaks_of_log(CleanResidual(residual[:, j], clean[:, j], period_s), N) for j in columns]


def joined(logs: Sequence[Peaks], joint: int) -> SustainedPeaks:
    return pooled_peaks([log[joint] for log in logs])


def row(*cells: object) -> str:
    return "| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |"


def head(*cells: str) -> None:
    print(row(*cells))
    print(row(*["---"] * len(cells)))


def dispersion(counts: np.ndarray) -> float:
    return float(counts.var(ddof=1) / counts.mean()) if counts.mean() > 0 else float("nan")


def facts(logs: Sequence[Peaks], joint: int, level: float) -> list[float]:
    peaks = joined(logs, joint)
    over = peaks.window[peaks.level_nm > level]
    minutes = np.bincount(over, minlength=peaks.window_hours.size)
    each = np.array([(log[joint].level_nm > level).sum() for log in logs])
    return [*np.quantile(peaks.level_nm, (0.5, 0.9, 0.99, 0.999)).tolist(), dispersion(minutes), dispersion(each)]


def memory(residual: np.ndarray, period_s: float) -> list[float]:
    x = np.nan_to_num(residual - np.nanmean(residual))
    power = float(np.mean(x * x))
    return [float(np.mean(x[: -round(lag / period_s)] * x[round(lag / period_s) :])) / power for lag in LAGS_S]


def faithful(real: Sequence[tuple[np.ndarray, np.ndarray]], made: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    """The generator beside simulated logs that it has not seen."""
    print("\n### The generator beside simulated logs that it was not fitted to\n")
    head("joint", "", "q50", "q90", "q99", "q99.9", "disp. min", "disp. log", *(f"acf {lag:g} s" for lag in LAGS_S))
    found = {"simulated": real, "generated": made}
    peaks = {name: [peaks_of(x, clean, PERIOD) for x, clean in logs] for name, logs in found.items()}
    for joint in range(real[0][0].shape[1]):
        level = float(np.quantile(joined(peaks["simulated"], joint).level_nm, 0.95))
        for name, logs in found.items():
            acf = np.mean([memory(x[:, joint], PERIOD) for x, _ in logs], axis=0).tolist()
            print(row(joint + 1, name, *facts(peaks[name], joint, level), *acf))


def true_rate(fresh: SustainedPeaks, gamma: float) -> float:
    return float((fresh.level_nm > gamma).sum()) / fresh.hours


def hold(source: Sequence[Peaks], counts: Sequence[int]) -> None:
    """The promise: the arm's true rate below the stated bound, gamma beside the best known."""
    joints = range(len(source[0]))
    fresh = [generated_peaks(source, 20_000 + seed) for seed in range(FRESH_LOGS)]
    truth = [joined(fresh, j) for j in joints]
    best = np.array([t.level_nm.max() for t in truth])
    hours = truth[0].hours
    print(f"\n### Recommended from generated evidence, judged by {hours:.0f} fresh hours\n")
    head(
        "evidence h",
        "runs",
        "bound stated, 1/h",
        "true rate below it",
        "alarms in the fresh hours, median (largest)",
        "gamma / best: median (5-95 %)",
        "joints within 1.5",
        "joints flagged loose",
        "beyond 1.5 and not flagged",
    )
    for logs in counts:
        below, alarms, ratios, loose, stated = [], [], [], [], 0.0
        for k in range(min(RUNS, MOST_LOGS // logs)):
            part = [generated_peaks(source, 100 * k + i) for i in range(logs)]
            items = [tail_evidence(joined(part, j), N) for j in joints]
            gammas = np.array([threshold(item.tail, TARGET, len(items)) or np.inf for item in items])
            stated = max(TARGET, 1 / (REACH * min(item.peaks.hours for item in items)))
            rate = sum(true_rate(t, g) for t, g in zip(truth, gammas, strict=True))
            below.append(rate <= stated)
            alarms.append(rate * hours)
            ratios.append(gammas / best)
            loose.append([looseness(item.tail, g) > LOOSE for item, g in zip(items, gammas, strict=True) if item.tail])
        low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95))
        beyond = np.array(ratios) > LOOSE
        shares = [100 * np.mean(x) for x in (below, ~beyond, loose, beyond & ~np.array(loose))]
        spread = f"{np.median(alarms):.0f} ({max(alarms):.0f})"
        ratio = f"{middle:.2f} ({low:.2f}-{high:.2f})"
        print(
            row(logs * 5 / 60, len(below), float(stated), f"{shares[0]:.0f} %", spread, ratio)
            + "".join(f" {share:.0f} % |" for share in shares[1:]),
            flush=True,
        )


def left_out(logs: Sequence[Peaks], judged: Sequence[Peaks], title: str) -> None:
    """Evidence of a few simulated logs, judged by all the others: what differs from log to log is in it.

    Args:
        logs: evidence, levels of the residual.
        judged: the same logs, levels less what thresholds are raised by in each.
        title: of the table.
    """
    joints = range(len(logs[0]))
    print(f"\n### Recommended from simulated logs, judged by the others ({len(logs)} logs in all): {title}\n")
    head("logs of evidence", "runs", "bound stated, 1/h", "rate in the others below it", "largest rate there")
    rng = np.random.default_rng(0)
    for count in (1, 2, 3, 6):
        chosen = [[k] for k in range(len(logs))]
        if count > 1:
            chosen = [rng.choice(len(logs), count, replace=False).tolist() for _ in range(24)]
        below, rates, stated = [], [], 0.0
        for own in chosen:
            items = [tail_evidence(joined([logs[k] for k in own], j), N) for j in joints]
            others = [judged[k] for k in range(len(logs)) if k not in own]
            gammas = [threshold(item.tail, TARGET, len(items)) or np.inf for item in items]
            stated = max(TARGET, 1 / (REACH * min(item.peaks.hours for item in items)))
            rates.append(sum(true_rate(joined(others, j), g) for j, g in zip(joints, gammas, strict=True)))
            below.append(rates[-1] <= stated)
        print(row(count, len(chosen), float(stated), f"{100 * np.mean(below):.0f} %", float(max(rates))), flush=True)


def inside(source: Sequence[Peaks], logs: int) -> None:
    """Bounds of the rate at levels inside the data's range, against the rate of the fresh hours."""
    joints = range(len(source[0]))
    fresh = [generated_peaks(source, 20_000 + seed) for seed in range(FRESH_LOGS)]
    truth = [joined(fresh, j) for j in joints]
    print(f"\n### Bounds (95 %) inside the data's range, {logs * 5} min of evidence in {logs} logs\n")
    head("expected peaks in the evidence", "bounds", "hold")
    held: dict[int, list[bool]] = {count: [] for count in (3, 10, 30, 60)}
    for k in range(3 * MOST_LOGS // logs // 2):
        part = [generated_peaks(source, 40_000 + 100 * k + i) for i in range(logs)]
        for j in joints:
            item = tail_evidence(joined(part, j), N)
            for count, found in held.items():
                rate = count / item.peaks.hours
                ranked = np.sort(truth[j].level_nm)[::-1]
                level = float(ranked[round(rate * truth[j].hours)])
                if item.tail is not None and level >= item.tail.begins_nm:
                    found.append(item.tail.rate_bound(level) >= true_rate(truth[j], level))
    for count, found in held.items():
        if found:
            print(row(count, len(found), f"{100 * np.mean(found):.1f} %"), flush=True)


def main(folders: Sequence[str]) -> None:
    global PERIOD
    logs, peaks, own, by_rule = [], [], [], []
    for folder in map(Path, folders):
        audit = read_run(folder)
        PERIOD = audit.result.log.sample_period_s
        placed, raised_nm = in_place(audit, read_friction(folder / FRICTION_NAME))
        residual, clean = made_of(audit.signals)
        own.append(peaks_of(residual, clean, PERIOD))
        by_rule.append(peaks_of(np.maximum(np.abs(residual) - raised_nm, 0.0), clean, PERIOD))
        logs.append(tuple(x.astype(np.float32) if x.dtype != bool else x for x in made_of(placed.signals)))
        peaks.append(peaks_of(*made_of(placed.signals), PERIOD))
    left_out(peaks, peaks, "one arm")
    left_out(own, by_rule, "gears moved between logs")
    n = min(x.shape[0] for x, _ in logs)
    source, held_back = [(x[:n], clean[:n]) for x, clean in logs[::2]], logs[1::2]
    faithful(held_back, [generated(source, 10_000 + seed, PERIOD) for seed in range(len(held_back))])
    hold(peaks[::2], (1, 2, 3, 6, 12, 24))
    for count in (3, 6, 12):
        inside(peaks[::2], count)


def made_of(signals: Signals) -> Made:
    """Residual and clean samples of a simulated log."""
    known = np.isfinite(signals.residual_nm)
    return np.where(known, signals.residual_nm, 0.0), (signals.state <= State.FRICTION_INTERVAL) & known


PERIOD = 0.002

if __name__ == "__main__":
    main(sys.argv[1:])
