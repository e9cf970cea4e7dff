"""What would have been noticed, in words: the one sentence that headlines, verdicts and reports say of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from collaudit.core.data.sensitivity_result import FOREARM, TOOL, AskedForce, ForceTime, NoticedForce, Sensitivity


def force_text(force_n: float | None) -> str:
    """A force that would have alarmed; rounded up, since a smaller one would not."""
    if force_n is None:
        return "no force"
    return f"{math.ceil(force_n):d} N" if force_n > 10.0 else f"{math.ceil(10.0 * force_n) / 10.0:g} N"


def place_text(force: NoticedForce, *, brief: bool = False) -> str:
    """Where a force acts; in brief without the note on a force sensor."""
    if force.kind == TOOL and force.before_sensor and not brief:
        return f"the {force.place} (on the arm's side of its force sensor)"
    return f"the {force.place}" if force.kind in (TOOL, FOREARM) else f"the end of {force.link}"


def time_text(time: ForceTime) -> str:
    """For how much of which time."""
    return f"in {100 * time.share:.3g} % of the {'moving ' if time.moving else ''}time"


def headline_forces(sensitivity: Sensitivity | None) -> Sequence[NoticedForce]:
    """The places that a headline speaks of, tool first: those that a force is asked for at, else tool and forearm."""
    if sensitivity is None:
        return []
    asked = [force for force, _ in asked_places(sensitivity)]
    return asked or [f for f in reversed(sensitivity.forces) if f.kind in (TOOL, FOREARM) and f.unfelt < 1.0]


def asked_places(sensitivity: Sensitivity) -> list[tuple[NoticedForce, AskedForce]]:
    """Places at which a force is asked for, the tool first."""
    return [(force, force.asked) for force in reversed(sensitivity.forces) if force.asked is not None]


def too_insensitive(sensitivity: Sensitivity) -> list[tuple[NoticedForce, AskedForce]]:
    """Places at which it takes a larger force than is asked for, the tool first."""
    share = 0.0 if sensitivity.time is None else sensitivity.time.share
    return [(force, need) for force, need in asked_places(sensitivity) if need.force_n < (force.at(share) or 0.0)]


def noticed_sentence(sensitivity: Sensitivity) -> str | None:
    """What a pass says it would have noticed; None where nothing is told."""
    forces, time = headline_forces(sensitivity), sensitivity.time
    if time is not None and forces:
        level = [(force.at(time.share), place_text(force)) for force in forces]
        noticed = [f"{force_text(force_n)} at {place}" for force_n, place in level if force_n is not None]
        never = [place for force_n, place in level if force_n is None]
        push, of_time = f"push ({1e3 * time.push_s:.4g} ms)", time_text(time)
        said = [f"Would have noticed a {push} of {listed(noticed)}, {of_time}."] if noticed else []
        said += [f"No {push} at {listed(never)}, however hard, would have been noticed {of_time}."] if never else []
        return " ".join(said)
    shares = [s.asked.share for s in sensitivity.joints.values() if s.asked is not None and s.motion_s > 0]
    if not shares:
        return None
    return f"The torque asked for would have alarmed in {100 * min(shares):.0f} % or more of each joint's motion."


def listed(parts: Sequence[str]) -> str:
    """``a, b and c``."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
