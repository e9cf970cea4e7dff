"""What a report of one hour of seven joints costs: size, time and memory, against reading its signals.

Run: ``python tests/bench/report_hour.py [minutes]``. Each part runs in a process of its own.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PERIOD_S = 0.002
JOINTS = 7


def write(folder: Path, minutes: float) -> None:
    """A run with fast motion, rests, noise, a gap and pushes."""
    import numpy as np

    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))
    import samples

    from collaudit.core.data.audit_result import Audit
    from collaudit.core.data.signals import Signals, State
    from collaudit.reports.files.run_files import write_run

    n = round(60 * minutes / PERIOD_S)
    time_s, rng = np.arange(n) * PERIOD_S, np.random.default_rng(1)
    names = (*samples.JOINTS, "seventh")
    shape = (n, JOINTS)
    velocity = np.empty(shape, order="F")
    residual = np.empty(shape, order="F")
    for j in range(JOINTS):
        velocity[:, j] = 0.6 * np.sin(2 * np.pi * time_s / (7 + j))
        residual[:, j] = np.convolve(rng.standard_normal(n), np.ones(20) / 20, "same")
    state = np.where(np.abs(velocity) < 0.05, State.FRICTION_INTERVAL, State.JUDGED).astype(np.int8)
    state[n // 3 : n // 3 + 1000] = State.GAP
    for k in range(60):
        residual[(k + 1) * n // 62 :, k % JOINTS][:80] += 6.0
    least = np.where(state == State.FRICTION_INTERVAL, residual - 3.0, np.nan).astype(np.float32)
    model = 20 * np.cos(velocity)
    wrench = np.zeros((n, 6))
    signals = Signals(
        time_s, names, velocity, velocity, model + residual, model, residual, state,
        np.full(state.shape, 4.0, np.float32), np.full(JOINTS, 0.8),
        least_nm=least, most_nm=least + 6.0, wrench=wrench,
    )  # fmt: skip
    result = samples.many_events(60).result
    at = [k * n // 62 * PERIOD_S for k in range(1, 61)]
    collisions = tuple(
        c.__class__(names[k % JOINTS], t, t + 0.024, 0.16, 6.5, 4.0, "free")
        for k, (c, t) in enumerate(zip(result.collisions, at, strict=True))
    )
    from dataclasses import replace

    log = replace(result.log, duration_s=float(time_s[-1]), joints=names)
    write_run(folder, Audit(replace(result, collisions=collisions, near_misses=(), log=log), signals), None)


def report(folder: Path) -> None:
    """The page as ``collaudit report`` makes it."""
    from collaudit.reports.files.run_files import open_run
    from collaudit.reports.page.html import write_html

    write_html(folder / "report.html", [open_run(folder)])


def read(folder: Path) -> None:
    """Reading the run, and no more."""
    from collaudit.reports.files.run_files import read_run

    read_run(folder)


def measured(part: str, folder: Path) -> tuple[float, float]:
    """Seconds of processor time and peak MB of one part in its own process."""
    subprocess.run([sys.executable, __file__, part, str(folder)], check=True)
    seconds, peak = (folder / f"{part}.txt").read_text().split()
    return float(seconds), float(peak)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if len(sys.argv) > 2 and sys.argv[1] == "write":
        write(Path(sys.argv[2]), float(sys.argv[3]))
    elif len(sys.argv) > 2:
        {"read": read, "report": report}[sys.argv[1]](Path(sys.argv[2]))
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        (Path(sys.argv[2]) / f"{sys.argv[1]}.txt").write_text(f"{time.process_time()} {peak_mb}")
    else:
        minutes = sys.argv[1] if len(sys.argv) > 1 else "60"
        with tempfile.TemporaryDirectory() as name:
            subprocess.run([sys.executable, __file__, "write", name, minutes], check=True)
            for part in ("read", "report"):
                seconds, peak_mb = measured(part, Path(name))
                print(f"{part}: {seconds:.2f} s of processor time with imports, peak {peak_mb:.0f} MB")
            print(f"page: {(Path(name) / 'report.html').stat().st_size / 1e6:.2f} MB")
