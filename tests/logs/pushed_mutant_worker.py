"""Audits mutants of a log with one push; prints what became of the push as JSON.

Run as a script: ``pushed_mutant_worker.py KIND COUNT SEED FOLDER``; KIND is one of ``mutant_worker.py``'s after
``audit-``.
A damaged log may show the push, be refused, be not judged, or pass with a statement that the whole log does not call
for. A pass without one is a complaint.
"""

from __future__ import annotations

import json
import random
import resource
import sys
import traceback
import warnings
from collections import Counter
from pathlib import Path

import log_writers as w
import numpy as np
from faulty_case import clean_signals
from mutant_worker import Overtime, at_most, mutate
from small_arm import small_arm

from collaudit.core import api
from collaudit.core.config import LoadedConfig, parse_config
from collaudit.core.data.audit_result import AuditResult, FrictionFile
from collaudit.core.errors import CollauditError

SECONDS = 20
MEGABYTES = 1024
#: What is taken of the signals of ``faulty_case.py``, whose push is at 9.0 to 9.3 s: 4 s at 125 Hz, and where it ends.
TAKEN = slice(1750, 2750, 2)
PUSH_ENDS_S = 2.3


def make(kind: str, folder: Path, config: str, push_nm: float) -> Path:
    """A small log of a kind, with a push or without."""
    said = clean_signals(config, push_nm)
    assert said.dq is not None and said.tau is not None
    t, q, dq, tau = (values[TAKEN] for values in (said.t, said.q, said.dq, said.tau))
    folder.mkdir(exist_ok=True)
    if kind.startswith("csv"):
        rows = np.column_stack([t - t[0], q, dq, tau])
        names = "t,q1,q2,dq1,dq2,tau1,tau2"
        path = folder / ("log.csv.gz" if kind == "csv-gz" else "log.csv")
        np.savetxt(path, rows, delimiter=",", header=names, comments="", fmt=["%.3f"] + 6 * ["%.9g"])
        return path
    stamps = w.EPOCH + np.rint((t - t[0]) * 1e9).astype(np.int64)
    return w.write_any(
        folder,
        kind,
        lambda encoding: [
            w.joint_state(["joint1", "joint2"], *row, stamp_ns=int(stamp), encoding=encoding)
            for stamp, *row in zip(stamps, q, dq, tau, strict=True)
        ],
    )


def statements(result: AuditResult) -> list[str]:
    """What an audit says of a log besides its verdict: exclusions, findings, and for how long it speaks."""
    said = [f.text for f in result.findings if f.severity != "info"]
    if result.log.duration_s < PUSH_ENDS_S:  # where the log's time ends before the push does, the reasons say so
        said += [text for text in result.reasons if f" in {result.log.duration_s:.3g} s" in text]
    return said + list(result.exclusions)


def outcome(result: AuditResult, known: set[str]) -> str:
    if result.contacts:
        return "found"
    if result.verdict != "pass":
        return "not judged"
    return "stated" if any(text not in known for text in statements(result)) else "silent"


def judge(path: Path, settings: LoadedConfig, friction: FrictionFile, known: set[str]) -> str:
    try:
        return outcome(api.audit((path,), settings, friction).result, known)
    except CollauditError:
        return "refused"


def run(kind: str, count: int, seed: int, folder: Path) -> dict[str, object]:
    """Audit so many mutants; stops at the tenth complaint."""
    text, friction = small_arm(folder / "arm")
    settings = parse_config(text, None)
    original = make(kind, folder / "log", text, 12.0)
    quiet = api.audit((make(kind, folder / "quiet", text, 0.0),), settings, friction).result
    known = set(statements(quiet))
    assert judge(original, settings, friction, known) == "found" and outcome(quiet, known) == "silent"
    data = original.read_bytes()
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEGABYTES * 2**20, resource.RLIM_INFINITY))
    outcomes: Counter[str] = Counter()
    complaints: list[str] = []
    path = folder / f"mutant{''.join(original.suffixes)}"
    for number in range(count):
        path.write_bytes(mutate(random.Random(f"audit-{kind}-{seed}-{number}"), data))
        try:
            with at_most(SECONDS):
                became, wrong = judge(path, settings, friction, known), ""
        except Overtime as error:
            became, wrong = "hang", str(error)
        except Exception:  # noqa: BLE001 (whatever it is, it is what is looked for)
            became, wrong = "crash", traceback.format_exc(limit=-4)
        outcomes[became] += 1
        if wrong or became == "silent":
            kept = folder / f"complaint-{seed}-{number}{''.join(original.suffixes)}"
            kept.write_bytes(path.read_bytes())
            complaints.append(f"audit-{kind} seed {seed} number {number}: {wrong or 'a pass that says nothing'}")
            if len(complaints) == 10:
                break
    return {"outcomes": outcomes, "complaints": complaints}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    kind = sys.argv[1].removeprefix("audit-")
    print(json.dumps(run(kind, int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))))
