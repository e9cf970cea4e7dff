"""What a trial measured, written into the draft beside the settings it speaks for."""

from __future__ import annotations

from collections.abc import Mapping

from collaudit.cli.drafts.config_text import Line, Section
from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, ChannelFacts
from collaudit.core.prepare.prepared import Prepared


def add_channel_facts(sections: Mapping[str, Section], prepared: Prepared, config: Config) -> dict[str, float]:
    """Delays and kind of the effort, by the audit of channels that ``collaudit fit`` makes.

    A delay counts where its interval excludes zero and is no wider than the delay, and the channel is late. One that is
    early is only shown, since no sensor is, and a filtered position looks like that.

    Args:
        sections: of the draft.
        prepared: the log with its model.
        config: it was prepared with.

    Returns:
        Dotted key to the delay that counts from now on, ms.
    """
    from collaudit.core.identification.channel_audit import audit_channels

    if prepared.rigid_nm is None or prepared.series.effort is None:
        return {}
    facts, findings = audit_channels(prepared, config)
    sections["log.units"].remarks += [f.text for f in findings if f.kind.setting == "log.units"]
    if not config.log.units.effort_sign:
        _add_sign_choice(sections["log.units"], prepared)
    return _add_delays(sections["log"], prepared, config, facts)


def add_effort_kind(sections: Mapping[str, Section], prepared: Prepared) -> bool:
    """That gravity is not in the effort, where the data show it; whether they do."""
    if prepared.start.effort_kind.compensated != "seen":
        return False
    why = "the effort holds the arm's inertia and none of its gravity; else motor-torque or joint-torque"
    sections["log"].put(Line("effort_kind", "gravity-compensated", why, guess=True))
    return True


def add_rest_threshold(sections: Mapping[str, Section], prepared: Prepared) -> bool:
    """Automatic thresholds for an arm that never moves: its own torque at rest tells them; whether they were put."""
    from collaudit.core.prepare.quiet_level import quiet_levels

    guessed = any(line.key == "gamma_nm" and line.guess for line in sections["detect"].lines)
    if not guessed or not quiet_levels(prepared):
        return False
    why = "from what torque does by itself at rest: the arm never moves here; from friction.json where there is one"
    sections["detect"].put(Line("gamma_nm", "auto", why, guess=True))
    return True


def _add_delays(log: Section, prepared: Prepared, config: Config, facts: ChannelFacts) -> dict[str, float]:
    counts: dict[str, float] = {}
    channels: tuple[tuple[str, float | None, Bounds | None], ...] = (
        ("effort_delay_ms", facts.effort_delay_ms, facts.effort_delay_ci95_ms),
        ("wrench_delay_ms", facts.wrench_delay_ms, facts.wrench_delay_ci95_ms),
    )
    for key, delay, bounds in channels:
        low, high = bounds or (None, None)
        if delay is None or low is None or high is None or low <= 0 <= high or key in config.log.given:
            continue
        if abs(delay) < 1e3 * prepared.series.period_s:
            continue
        late = delay > 0 and high - low <= delay
        doubt = "ahead of the motion, so check it first" if delay < 0 else "too vague to count: check it first"
        why = f"measured: {low:.1f} to {high:.1f} ms, 95 %; {'taken off' if late else doubt}"
        log.add(key, round(delay, 1), why, active=late)
        if late:
            counts[f"log.{key}"] = round(delay, 1)
    return counts


def _add_sign_choice(units: Section, prepared: Prepared) -> None:
    """The signs that the data do not decide: only the joints that show an inverted one, or the whole drive alike."""
    found = {f.joint for f in prepared.findings if f.kind.setting == "log.units.effort_sign"}
    inverted = [name for name in prepared.judged if name in found]
    upright = [g.joint for g in prepared.gains if g.known and g.joint not in found]
    silent = [name for name in prepared.judged if name not in (*inverted, *upright)]
    if prepared.sign_delay is not None or len(inverted) < 2 or upright or not silent:
        return
    if prepared.upright.intersection(inverted):  # the mounting is asked for there, and no sign
        return
    shown = "; ".join(
        f"{g.joint} {g.gain:.2f} ({g.ci95[0]:.2f} to {g.ci95[1]:.2f})" for g in prepared.gains if g.inverted
    )
    units.remarks.append(
        f"QUESTION: which efforts are inverted? Per N·m of model torque: {shown}, so these are, or the model is wrong "
        f"in the same way. {', '.join(silent)}: the motion does not show it; that every joint which shows its sign is "
        "inverted speaks for one convention of the whole robot. Uncomment one line:"
    )
    every = dict.fromkeys(prepared.judged, -1)
    units.add("effort_sign", every, "all joints alike", active=False)
