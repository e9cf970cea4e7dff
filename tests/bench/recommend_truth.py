"""How well recommended thresholds hold: bounds against the truth of 50 fresh hours, and a generator's faithfulness.

    python tests/bench/recommend_truth.py RUN... > tables.md

RUN: folders of ``collaudit detect`` on simulated clean logs of one arm, five minutes each, two dozen of them. Every
other one feeds the generator, the rest is what it is compared with.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from residual_generator import Made, generated

from collaudit.core.data.signals import Signals, State
from collaudit.core.recommend.joint_thresholds import REACH, tail_evidence, threshold
from collaudit.core.recommend.recommendation import CleanResidual
from collaudit.core.recommend.sustained_levels import LogPeaks, SustainedPeaks, peaks_of_log, pooled_peaks
from collaudit.reports.files.run_files import read_run

N, TARGET = 13, 1e-3
FRESH_LOGS, EVIDENCE_LOGS, RUNS = 624, 288, 40
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


def hold(fresh: Sequence[Peaks], pool: Sequence[Peaks], counts: Sequence[int]) -> None:
    """The promise: the arm's true rate below the stated bound, gamma beside the best known."""
    joints = range(len(fresh[0]))
    truth = [joined(fresh, j) for j in joints]
    best = [float(t.level_nm.max()) for t in truth]
    hours = truth[0].hours
    print(f"\n### Recommended from generated evidence, judged by {hours:.0f} fresh hours\n")
    head(
        "evidence h",
        "runs",
        "bound stated, 1/h",
        "true rate below it",
        "alarms in the fresh hours, median (largest)",
        "gamma / best: median",
        "5-95 %",
        "joints within 1.5",
    )
    for logs in counts:
        if logs > len(pool):
            continue
        below, alarms, ratios = [], [], []
        runs = min(RUNS, len(pool) // logs) if logs > 6 else RUNS
        stated = 0.0
        for k in range(runs):
            chosen = np.random.default_rng(k).choice(len(pool), logs, replace=False) if logs <= 6 else None
            part = [pool[i] for i in chosen] if chosen is not None else pool[k * logs : (k + 1) * logs]
            items = [tail_evidence(joined(part, j), N) for j in joints]
            gammas = [threshold(item.tail, TARGET, len(items)) or np.inf for item in items]
            stated = max(TARGET, 1 / (REACH * min(item.peaks.hours for item in items)))
            rate = sum(true_rate(t, g) for t, g in zip(truth, gammas, strict=True))
            below.append(rate <= stated)
            alarms.append(rate * hours)
            ratios.append([g / b for g, b in zip(gammas, best, strict=True)])
        low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95))
        share = float(np.mean(np.array(ratios) <= 1.5))
        spread = f"{np.median(alarms):.0f} ({max(alarms):.0f})"
        cells = (
            f"{100 * np.mean(below):.0f} %",
            spread,
            float(middle),
            f"{low:.2f}-{high:.2f}",
            f"{100 * share:.0f} %",
        )
        print(row(logs * 5 / 60, runs, float(stated), *cells))


def left_out(logs: Sequence[Peaks]) -> None:
    """Evidence of a few simulated logs, judged by all the others: what differs from log to log is in it."""
    joints = range(len(logs[0]))
    print(f"\n### Recommended from simulated logs, judged by the others ({len(logs)} logs in all)\n")
    head("logs of evidence", "runs", "bound stated, 1/h", "rate in the others below it", "largest rate there")
    rng = np.random.default_rng(0)
    for count in (1, 2, 3, 6):
        chosen = [[k] for k in range(len(logs))]
        if count > 1:
            chosen = [rng.choice(len(logs), count, replace=False).tolist() for _ in range(24)]
        below, rates, stated = [], [], 0.0
        for own in chosen:
            items = [tail_evidence(joined([logs[k] for k in own], j), N) for j in joints]
            others = [logs[k] for k in range(len(logs)) if k not in own]
            gammas = [threshold(item.tail, TARGET, len(items)) or np.inf for item in items]
            stated = max(TARGET, 1 / (REACH * min(item.peaks.hours for item in items)))
            rates.append(sum(true_rate(joined(others, j), g) for j, g in zip(joints, gammas, strict=True)))
            below.append(rates[-1] <= stated)
        print(row(count, len(chosen), float(stated), f"{100 * np.mean(below):.0f} %", float(max(rates))))


def inside(fresh: Sequence[Peaks], pool: Sequence[Peaks], logs: int) -> None:
    """Bounds of the rate at levels inside the data's range, against the rate of the fresh hours."""
    joints = range(len(fresh[0]))
    truth = [joined(fresh, j) for j in joints]
    print(f"\n### Bounds (95 %) inside the data's range, {logs * 5} min of evidence in {logs} logs\n")
    head("expected peaks in the evidence", "bounds", "hold")
    held: dict[int, list[bool]] = {count: [] for count in (3, 10, 30, 60)}
    for k in range(len(pool) // logs):
        for j in joints:
            item = tail_evidence(joined(pool[k * logs : (k + 1) * logs], j), N)
            for count, found in held.items():
                rate = count / item.peaks.hours
                ranked = np.sort(truth[j].level_nm)[::-1]
                level = float(ranked[round(rate * truth[j].hours)])
                if item.tail is not None and level >= item.tail.begins_nm:
                    found.append(item.tail.rate_bound(level) >= true_rate(truth[j], level))
    for count, found in held.items():
        if found:
            print(row(count, len(found), f"{100 * np.mean(found):.1f} %"))


def main(folders: Sequence[str]) -> None:
    global PERIOD
    audits = [read_run(Path(folder)) for folder in folders]
    PERIOD = audits[0].result.log.sample_period_s
    logs = [made_of(audit.signals) for audit in audits]
    n = min(x.shape[0] for x, _ in logs)
    source, held_back = [(x[:n], clean[:n]) for x, clean in logs[::2]], logs[1::2]
    left_out([peaks_of(x, clean, PERIOD) for x, clean in logs])
    faithful(held_back, [generated(source, 10_000 + seed, PERIOD) for seed in range(len(held_back))])
    pool = [peaks_of(*generated(source, seed, PERIOD), PERIOD) for seed in range(EVIDENCE_LOGS)]
    fresh = [peaks_of(*generated(source, 20_000 + seed, PERIOD), PERIOD) for seed in range(FRESH_LOGS)]
    hold(fresh, pool, (1, 3, 6, 12, 24))
    for logs in (6, 12):
        inside(fresh, pool, logs)


def made_of(signals: Signals) -> Made:
    """Residual and clean samples of a simulated log."""
    known = np.isfinite(signals.residual_nm)
    return np.where(known, signals.residual_nm, 0.0), (signals.state <= State.FRICTION_INTERVAL) & known


PERIOD = 0.002

if __name__ == "__main__":
    main(sys.argv[1:])
