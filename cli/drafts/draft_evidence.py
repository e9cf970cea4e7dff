"""What a trial measured, written into the draft beside the settings it speaks for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.cli.drafts.config_text import Section
from collaudit.cli.drafts.trial import Trial
from collaudit.core.config.schema import Config
from collaudit.core.data.identification_result import Bounds, ChannelFacts
from collaudit.core.data.joint_log import JointLog
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.channel_noise import bend_of, noise_of
from collaudit.core.prepare.prepared import Prepared
from collaudit.reports.terminal.text_table import table

#: Rows of which noise is told, and the fewest.
_ROWS, _FEWEST = 100_000, 100
_EFFORT_UNIT = {"Nm": "N·m", "raw": "raw"}


def add_measurements(sections: Mapping[str, Section], trial: Trial) -> None:
    """Clock and noise of the log as remarks of ``[log]``; the delay of its velocity in ``[conditioning]``.

    Args:
        sections: of the draft, by name.
        trial: whose log is measured.
    """
    if trial.log is None or trial.log.time_s.size < 2:
        return
    unit = _EFFORT_UNIT.get(trial.log.effort_unit, trial.log.effort_unit)
    remarks = [_clock_words(trial.log, trial.tried_s)]
    remarks.append(
        "Noise from sample to sample (standard deviation), or the steps of a channel, where these are larger:"
    )
    remarks += _table(trial.log, unit)
    sections["log"].remarks += remarks
    series = trial.prepared.series if trial.prepared is not None else None
    if series is not None and series.velocity_lag_s is not None and series.velocity_lag_s > 0:
        late = f"The logged velocity is {1e3 * series.velocity_lag_s:.1f} ms behind the positions"
        sections["conditioning"].remarks.append(
            f'{late} (median of the joints; see inspect -v). velocity = "auto" takes that into account.'
        )


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
    sections["log"].guess("effort_kind", "gravity-compensated", why)
    return True


def add_rest_threshold(sections: Mapping[str, Section], prepared: Prepared) -> bool:
    """Automatic thresholds for an arm that never moves: its own torque at rest tells them; whether they were put."""
    from collaudit.core.prepare.quiet_level import quiet_levels

    guessed = any(line.key == "gamma_nm" and line.guess for line in sections["detect"].lines)
    if not guessed or not quiet_levels(prepared):
        return False
    why = "from what torque does by itself at rest: the arm never moves here; from friction.json where there is one"
    sections["detect"].guess("gamma_nm", "auto", why)
    return True


def _add_delays(log: Section, prepared: Prepared, config: Config, facts: ChannelFacts) -> dict[str, float]:
    counts: dict[str, float] = {}
    channels: tuple[tuple[str, str, float | None, Bounds | None], ...] = (
        ("effort", "effort_delay_ms", facts.effort_delay_ms, facts.effort_delay_ci95_ms),
        ("wrench", "wrench_delay_ms", facts.wrench_delay_ms, facts.wrench_delay_ci95_ms),
    )
    for channel, key, delay, bounds in channels:
        low, high = bounds or (None, None)
        if delay is None and channel == "effort":
            log.remarks.append("The motion of this log does not determine the delay of the effort.")
        if delay is None or low is None or high is None or key in config.log.given:
            continue
        span = f"{low:.1f} to {high:.1f} ms, 95 %"
        if low <= 0 <= high or abs(delay) < 1e3 * prepared.series.period_s:
            said = "its interval holds 0" if low <= 0 <= high else "shorter than one sample"
            log.remarks.append(f"Delay of the {channel} against the motion: {delay:.1f} ms ({span}); {said}.")
            continue
        late = delay > 0 and high - low <= delay
        doubt = "ahead of the motion, so check it first" if delay < 0 else "too vague to count: check it first"
        why = f"measured: {span}; {'taken off' if late else doubt}"
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


def _clock_words(log: JointLog, tried_s: float) -> str:
    steps = np.diff(log.time_s[np.isfinite(log.time_s)])
    low, middle, high = (1e3 * float(x) for x in np.percentile(steps, [5, 50, 95]))
    rate = f" ({1e3 / middle:.5g} Hz)" if middle > 0 else ""
    return (
        f"Measured on {tried_s:.4g} s: a sample each {middle:.5g} ms{rate}, 5-95 % of the steps {low:.4g} to "
        f"{high:.4g} ms, longest {1e3 * float(steps.max()):.4g} ms."
    )


def _table(log: JointLog, unit: str) -> list[str]:
    channels = {"position": log.position_rad, "velocity": log.velocity_rad_s, f"effort [{unit}]": log.effort}
    held = {head: values[:_ROWS] for head, values in channels.items() if values is not None}
    rows = [[name, *(_cell(values[:, j]) for values in held.values())] for j, name in enumerate(log.joint_names)]
    return table(["joint", *held], rows).splitlines()


def _cell(values: FloatArray) -> str:
    """The noise of one channel (n,), or the steps that hide it."""
    known = values[np.isfinite(values)]
    if known.size < _FEWEST or not np.ptp(known) > 0.0:
        return "constant"
    noise = noise_of(known, bend_of(known), np.ones(known.size, dtype=np.bool_))
    return f"steps of {noise.resolution:.2g}" if noise.coarse else f"{noise.sd:.2g}"
