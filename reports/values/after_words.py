"""What an arm did in the second after a contact, and how the force acted, in words."""

from __future__ import annotations

from collaudit.core.data.detection_result import AfterContact, ToolMotion
from collaudit.reports.values.numbers import UNKNOWN, duration, fixed, percent, significant, speed

_MOTION: dict[ToolMotion, str] = {
    "went on": "the tool did not stop",
    "slowed": "the tool slowed to {share} of {speed}, from {slowing} on",
    "turned back": "the tool turned back, slowing from {slowing} on",
    "stopped": "the tool stopped after {stopped} and {way} mm, slowing from {slowing} on",
    "stood": "the tool stood already",
    "unknown": "what the tool did is not known",
}


def after_text(after: AfterContact | None) -> str:
    """``the tool stopped after 320 ms and 41 mm, …; transient (…)``; empty in files of earlier versions."""
    if after is None:
        return ""
    alarm = "" if after.controller_s is None else f"; controller alarm at {_ms(after.controller_s)}"
    kept = duration(after.force_s)
    load = {
        "quasi-static": f"pressed on (quasi-static, {kept} above γ)",
        "transient": f"transient ({kept} above γ)",
        "unknown": f"above γ for at least {kept}",
    }[after.load]
    return f"{motion_text(after)}{alarm}; {load}"


def motion_text(after: AfterContact) -> str:
    """What the tool did, with when and how far; times from the onset."""
    return _MOTION[after.motion].format(
        share=percent(after.slowest, 0),
        speed=speed(after.speed_m_s, "m/s"),
        slowing=_ms(after.slowing_s),
        stopped=_ms(after.stopped_s),
        way=significant(None if after.stopping_m is None else 1e3 * after.stopping_m),
    )


def _ms(seconds: float | None) -> str:
    return UNKNOWN if seconds is None else f"{fixed(1e3 * seconds, 0)} ms"
