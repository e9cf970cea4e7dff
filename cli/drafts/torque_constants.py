"""Torque constants that nobody stated, estimated from the robot's description and written as guesses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from collaudit.cli.drafts.draft import Draft
from collaudit.cli.drafts.trial import try_log
from collaudit.core.api import LogFiles
from collaudit.core.errors import CollauditError

_SOURCE = "gravity and inertia of the robot's description"
_TELLS = "motion that lifts what the joint carries, from a pose where gravity loads it, or a known load at the tool"


def add_torque_constants(draft: Draft, files: LogFiles, place: Path) -> None:
    """Constants for currents that have none; where a joint does not tell its own, the effort stays in its unit.

    Args:
        draft: whose ``[log.units]`` is completed.
        files: the log.
        place: of the configuration.
    """
    units = draft.sections["log.units"]
    live = {line.key: line for line in units.lines if line.active}
    if "effort" not in live or live["effort"].value != "A" or "torque_constant_nm_per_a" in live:
        return
    units.guess("effort", "raw", "currents without torque constants: collaudit fit identifies the gains that it can")
    joints, gains = _gains(draft, files, place)
    if not gains:
        if not joints:
            units.put(live["effort"])  # nothing could be tried: what is missing is said of that line
        return
    silent = [joint for joint in joints if joint not in gains]
    spans = "; ".join(f"{joint} {_constant(*gains[joint])}" for joint in gains)
    units.remarks.append(f"Torque constants by {_SOURCE}, N·m/A [95 %]: {spans}.")
    if silent:
        units.remarks.append(f"This motion does not tell those of {', '.join(silent)}. What would: {_TELLS}.")
        return
    units.put(live["effort"])
    constants = {joint: float(f"{1.0 / abs(gain):.4g}") for joint, (gain, _, _) in gains.items()}
    units.guess("torque_constant_nm_per_a", constants, f"by {_SOURCE}")
    inverted = {joint: -1 for joint, (gain, _, _) in gains.items() if gain < 0.0}
    if inverted and "effort_sign" not in live:
        units.guess("effort_sign", inverted, "these run against the model")


def _gains(
    draft: Draft, files: LogFiles, place: Path
) -> tuple[tuple[str, ...], Mapping[str, tuple[float, float, float]]]:
    """Judged joints (none where the log could not be tried), and for those that tell it A per N·m with its interval."""
    from collaudit.core.config import parse_config
    from collaudit.core.identification.estimate_choice import choose
    from collaudit.core.identification.identification import identify

    loaded = parse_config(draft.text(), place)
    config = loaded.config.changed({"fit": loaded.config.fit.changed({"estimate": "auto"})})
    prepared = try_log(files, loaded, audit=False).prepared
    if prepared is None or not prepared.robot.has_inertials:
        return (), {}
    try:
        found = identify([prepared], config, choose([prepared], config)[0])
    except CollauditError:
        found = None
    told = {} if found is None else found.joints
    constants = {}
    for joint in (joint for joint in told if joint in prepared.judged):
        gain, (low, high) = told[joint].gain, told[joint].gain_ci95 or (None, None)
        if gain and low is not None and high is not None:
            constants[joint] = (gain, low, high)
    return tuple(prepared.judged), constants


def _constant(gain: float, low: float, high: float) -> str:
    """1/gain with its interval; open above where the gain may be nothing."""
    least, most = sorted((abs(low), abs(high)))
    above = "∞" if low <= 0.0 <= high else f"{1.0 / least:.3g}"
    return f"{1.0 / abs(gain):.4g} [{1.0 / most:.3g} to {above}]"
