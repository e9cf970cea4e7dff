"""Faults that fitted and judged log share, one by one: a push of the asked force never passes.

Contact in the fit, samples that are no measurement, stamps and cuts have tests of their own
(``identification/test_log_cleaning.py``, ``audit/test_unmeasured_contacts.py``). Here the worst of the kinds are tried;
``make spoilt`` tries every strength of every kind on both arms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from collaudit.cli.drafts import trial

#: The judged log whose push at the forearm has the force that is asked for there, or more.
ASKED = 1
#: Class and name, as in ``log_faults``, by the arm that is spoilt so; both are in the table.
SHARED = {
    "paper6": (
        ("scale", "efforts of all × 0.5"),
        ("low-pass", "1 Hz"),
        ("description lacks", "tool and rotor inertia"),
    ),
    "seven": (
        ("low-pass", "zero-phase 3 Hz"),
        ("held", "effort held at 20 Hz"),
        ("joints swapped", "efforts of 2 and 3"),
    ),
}
#: What spoils the windows around a touch: of the resting arm's recordings.
ON_TOUCHES = (("low-pass", "0.5 Hz"), ("low-pass", "2 Hz"), ("resampled", "one row of 5"))


@pytest.fixture(scope="module")
def campaign() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).parent))
        module = import_module("spoilt_logs")
        # What is said of logs without fault tells one pass from another; here none may pass. The trial of `init` says
        # whether a log can be judged, not what is written: it reads the log alone.
        patch.setattr(module.Arm, "usual", lambda _arm, _stated: frozenset())
        tried = trial._tried
        patch.setattr(trial, "_tried", lambda begun, log, loaded, _, report: tried(begun, log, loaded, False, report))
        yield module


@pytest.fixture(scope="module")
def arms(campaign: Any, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Any]:
    return cache(lambda robot: campaign.Arm(robot, 20261125, tmp_path_factory.mktemp(robot)))


@pytest.mark.parametrize(
    ("robot", "kind", "name"), [(robot, *one) for robot, faults in SHARED.items() for one in faults]
)
def test_a_push_of_the_asked_force_never_passes(
    campaign: Any, arms: Callable[[str], Any], robot: str, kind: str, name: str
) -> None:
    (fault,) = (one for one in campaign.FAULTS if (one.kind, one.name) == (kind, name))
    assert arms(robot).pushed(ASKED).asked
    found = campaign.outcome(arms(robot), fault, "both", stated=False, number=ASKED)
    assert found["outcome"] in ("found", "alarm elsewhere", "not judged"), found


@pytest.mark.real
def test_touches_in_spoilt_recordings_never_pass_in_silence(data_dir: Path, tmp_path: Path, campaign: Any) -> None:
    touches, listed, faults = map(import_module, ("spoilt_touches", "real_log_list", "log_faults"))
    one = listed.TOUCH_LOGS[0]
    settings = one.settings(data_dir, tmp_path)
    log = touches.api.open_log(one.files(data_dir, tmp_path), settings)
    (label,) = (mark for mark in log.annotations if mark.name == "label")
    middles = tuple((start + end) / 2 for start, end in label.intervals_s)
    place = faults.Place(middles, touches.api.load_robot(settings, log.joint_names), "", np.random.default_rng(0))
    usual = touches.statements(touches.judged(log, settings, None).result)
    for kind, name in ON_TOUCHES:
        (fault,) = (fault for fault in touches.FAULTS if (fault.kind, fault.name) == (kind, name))
        assert touches.outcome(log, settings, fault, place, usual) not in ("silent", "crash"), (kind, name)
