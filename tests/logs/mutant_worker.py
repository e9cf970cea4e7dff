"""Reads mutants of one valid log under limits of time and memory; prints what became of them as JSON.

Run as a script: ``mutant_worker.py KIND COUNT SEED FOLDER``; of several kinds with commas between, a line of JSON each.
"""

from __future__ import annotations

import gc
import json
import random
import resource
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import log_writers as w
import numpy as np

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log

SECONDS = 5
MEGABYTES = 768
SETTINGS = LogConfig.of({"wrench": "/ft/wrench"})
#: Kinds whose bytes are under a check sum: what is read must be what was written.
CHECKED = ("mcap-zstd", "mcap-lz4", "mcap-none")
#: Kinds that say how many messages there are: none may be missing without a word.
COUNTED = (*CHECKED, "mcap-plain", "mcap-unchunked", "mcap-ros1", "bag-none", "bag-lz4", "bag-bz2")
SAYING = {"log-partial", "log-left-out", "log-nan"}
EXTREMES = (b"\xff" * 4, b"\0" * 4, b"\xff\xff\xff\x7f", (50 * 2**30).to_bytes(8, "little"), b"\xff" * 8, b"\x01\0\0\0")


class Overtime(BaseException):
    """A mutant took too long; not an Exception, so that nothing catches it."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """A context of so many seconds of the processor, and of 12 times as many by the clock; then Overtime says which."""
    limits = {
        signal.SIGPROF: (signal.ITIMER_PROF, seconds, "of the processor"),
        signal.SIGALRM: (signal.ITIMER_REAL, 12 * seconds, "by the clock"),
    }

    def end(number: int, _frame: object) -> None:
        _, limit, by = limits[signal.Signals(number)]
        raise Overtime(f"took more than {limit:g} s {by}")

    before = {number: signal.signal(number, end) for number in limits}
    try:
        for timer, limit, _ in limits.values():
            signal.setitimer(timer, limit)
        yield
    finally:
        for timer, _, _ in limits.values():
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


def make(kind: str, folder: Path) -> Path:
    """A small valid log of a kind."""
    if kind.startswith("csv"):
        rows = ["t,q1,q2,dq1,dq2,tau1,tau2"]
        rows += [",".join(f"{x:.6g}" for x in (k * 0.002, *np.sin(np.arange(6) + k))) for k in range(60)]
        path = folder / "log.csv"
        text = ("\n".join(rows) + "\n").encode()
        if kind == "csv-gz":
            import gzip

            text = gzip.compress(text)
        path.write_bytes(text)
        return path
    return w.write_any(folder, kind, lambda encoding: w.motion(40, joints=3, encoding=encoding))


def mutate(rng: random.Random, data: bytes) -> bytes:
    """One to three of: flipped bytes, cuts, removed, doubled, zeroed, moved blocks, extreme integers."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if len(out) < 16:
            break
        at = rng.randrange(len(out))
        size = rng.choice((1, 2, 4, 8, 16, 64, 512))
        what = rng.randrange(9)
        if what <= 1:
            out[at] ^= 1 << rng.randrange(8)
        elif what == 2:
            out[at] = rng.randrange(256)
        elif what == 3:
            del out[at:]
        elif what == 4:
            del out[at : at + size]
        elif what == 5:
            out[at:at] = out[at : at + size]
        elif what == 6:
            out[at : at + size] = bytes(min(size, len(out) - at))
        elif what == 7:
            extreme = rng.choice(EXTREMES)
            out[at : at + len(extreme)] = extreme
        else:
            other = rng.randrange(len(out))
            out[at : at + size] = out[other : other + size]
    return bytes(out)


def arrays(log: JointLog) -> list[Any]:
    parts = [log.time_s, log.position_rad, log.velocity_rad_s, log.effort]
    return [part for part in parts if part is not None]


def admits(log: JointLog) -> bool:
    """Whether a finding says that samples are missing, or were merged onto others' stamps."""
    return any(f.code in SAYING or "were merged by name" in f.text for f in log.findings)


def complaint(kind: str, log: JointLog, reference: JointLog) -> str | None:
    """What is wrong with the log read from a mutant, or None."""
    partial = any(finding.code == "log-partial" for finding in log.findings)
    lost = log.time_s.shape[0] < reference.time_s.shape[0]
    if kind in COUNTED and lost and not admits(log):
        return f"{reference.time_s.shape[0] - log.time_s.shape[0]} samples are missing and nothing says so"
    if kind in CHECKED and not partial and log.position_rad.shape[1:] == reference.position_rad.shape[1:]:
        known = {row.tobytes() for row in reference.position_rad}
        if any(row.tobytes() not in known for row in log.position_rad):
            return "positions were read that were never written"
    return None


def judge(kind: str, path: Path, reference: JointLog) -> tuple[str, str | None]:
    """(outcome, complaint) of one mutant."""
    outcome = "refused"
    try:
        describe((path,))
    except CollauditError as error:
        if not error.message or "\n" in error.message:
            return outcome, f"a message that is not one line: {error.message!r}"
    try:
        log = read_log((path,), SETTINGS, robot_joints=None)
    except CollauditError:
        return outcome, None
    same = len(arrays(log)) == len(arrays(reference)) and all(
        np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays(log), arrays(reference), strict=True)
    )
    outcome = "same" if same else "partial" if admits(log) else "other data"
    return outcome, complaint(kind, log, reference)


def run(kind: str, count: int, seed: int, folder: Path) -> dict[str, Any]:
    """Judge so many mutants; stops at the tenth complaint."""
    original = make(kind, folder)
    reference = read_log((original,), SETTINGS, robot_joints=None)
    data = original.read_bytes()
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEGABYTES * 2**20, resource.RLIM_INFINITY))
    outcomes: Counter[str] = Counter()
    complaints: list[str] = []
    path = folder / f"mutant{original.suffix}"
    for number in range(count):
        path.write_bytes(mutate(random.Random(f"{kind}-{seed}-{number}"), data))
        try:
            with at_most(SECONDS):
                outcome, wrong = judge(kind, path, reference)
        except Overtime as error:
            outcome, wrong = "hang", str(error)
        except Exception:  # noqa: BLE001 (whatever it is, it is what the test looks for)
            outcome, wrong = "crash", traceback.format_exc(limit=-4)
        outcomes[outcome] += 1
        if wrong is not None:
            complaints.append(f"{kind} seed {seed} number {number}: {wrong}")
            (folder / f"complaint-{seed}-{number}{original.suffix}").write_bytes(path.read_bytes())
            if len(complaints) == 10:
                break
    return {"outcomes": outcomes, "complaints": complaints}


if __name__ == "__main__":
    gc.set_threshold(200_000, 10, 20)  # as in the commands
    for kind, count in zip(sys.argv[1].split(","), sys.argv[2].split(","), strict=True):
        own = Path(sys.argv[4]) / kind
        own.mkdir()
        print(json.dumps(run(kind, int(count), int(sys.argv[3]), own)))
