"""Labelled touches of a real resting arm, in logs spoilt on purpose: a table of docs/evidence.md (``make spoilt``).

    python tests/bench/spoilt_touches.py --data DIR [-o docs/evidence.md]

Every fault of ``log_faults`` and ``stretch_faults`` that needs no model is done to each of the six logs; what spoils a
stretch does so at every touch.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

import numpy as np
import stretch_faults
from changed_logs import judged, named
from log_faults import FAMILIES, LogFault, Place
from real_log_list import TOUCH_LOGS
from spoilt_logs import OUTCOMES, statements
from tables import put

from collaudit.core import api
from collaudit.core.config import LoadedConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.errors import CollauditError
from collaudit.core.robot.robot_model import RobotModel

FAULTS = tuple(
    fault
    for family in (*FAMILIES, stretch_faults.stretches, stretch_faults.stamps)
    for fault in family()
    if fault.change is not None and not fault.fit_only and fault.kind != "load not stated"
)
_AROUND_S = 0.5


def outcome(log: JointLog, settings: LoadedConfig, fault: LogFault, place: Place, usual: set[str]) -> str:
    """What becomes of the touches of one log."""
    assert fault.change is not None
    (label,) = (one for one in log.annotations if one.name == "label")
    try:
        result = judged(named(fault.change(log, place), fault.name), settings, None).result
    except CollauditError:
        return "not judged"
    except Exception as error:  # noqa: BLE001 a bug of what is measured is one of its outcomes
        print(f"{fault.kind}, {fault.name}: {type(error).__name__}: {error}", file=sys.stderr)
        return "crash"
    if result.verdict == "fail":
        near = (
            one.onset_s < end + _AROUND_S and one.end_s > start - _AROUND_S
            for one in result.contacts
            for start, end in label.intervals_s
        )
        return "found" if any(near) else "alarm elsewhere"
    if result.verdict == "not_judged":
        return "not judged"
    return "stated" if statements(result) - usual else "silent"


def main(arguments: list[str]) -> None:
    """As the module's first lines say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of real logs")
    parser.add_argument("-o", "--output", type=Path, help="page whose table is replaced")
    given = parser.parse_args(arguments)
    found: dict[str, Counter[str]] = defaultdict(Counter)
    with tempfile.TemporaryDirectory() as folder:
        for number, one in enumerate(TOUCH_LOGS):
            settings = one.settings(given.data, Path(folder))
            log = api.open_log(one.files(given.data, Path(folder)), settings)
            (label,) = (mark for mark in log.annotations if mark.name == "label")
            model: RobotModel = api.load_robot(settings, log.joint_names)
            usual = statements(judged(log, settings, None).result)
            for fault in FAULTS:
                middles = tuple((start + end) / 2 for start, end in label.intervals_s)
                place = Place(middles, model, "", np.random.default_rng(number))
                found[fault.kind][outcome(log, settings, fault, place, usual)] += 1
            print(one.name, file=sys.stderr, flush=True)
    lines = [f"| class | tried | {' | '.join(OUTCOMES)} |", "|---|---|" + "---|" * len(OUTCOMES)]
    for kind, counts in [*found.items(), ("**all**", sum(found.values(), Counter()))]:
        lines.append(f"| {kind} | {counts.total()} | {' | '.join(str(counts[name]) for name in OUTCOMES)} |")
    print("\n".join(lines))
    if given.output:
        put(given.output, "spoilt-touches", lines)


if __name__ == "__main__":
    main(sys.argv[1:])
