"""What is known about a log's events from outside the residual: true events to score by, the controller's alarms."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.config.schema import DetectConfig
from collaudit.core.contacts.controller_alarms import is_named
from collaudit.core.data.detection_result import Score
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.errors import ConfigError
from collaudit.core.scoring.detection_score import Alarm, JudgedResidual, TrueEvent, score
from collaudit.core.scoring.truth_events import TruthFile, true_events


def score_detection(
    series: UniformSeries, run: DetectorRun, inputs: DetectionInputs, config: DetectConfig, truth: TruthFile | None
) -> tuple[Score, ...]:
    """Score a detector against the known events; empty when none are known.

    Args:
        series: the judged joints.
        run: what the detector made of them.
        inputs: the rule and the watched joints.
        config: labels of the log that mark true events.
        truth: a truth file or table of labels, which wins over the log's own.

    Raises:
        LogError: the file cannot be understood.
        ConfigError: the log has no such label.
    """
    if truth is None and not config.true_events:
        return ()
    watched = inputs.rule.watch
    events = true_events(truth, watched) if truth is not None else labelled_events(series, watched, config.true_events)
    alarms = [Alarm(c.joint, c.onset_s, c.detected_s) for c in run.detected.collisions]
    ratio = run.residual.torque_nm / run.threshold.all_joints()
    judged = JudgedResidual(series.time_s, ratio, run.detected.state, series.joint_names, inputs.rule.n)
    return tuple(s for s in score(events, alarms, judged) if s.joint is None or s.joint in watched)


def labelled_events(series: UniformSeries, watched: Sequence[str], wanted: Sequence[str]) -> list[TrueEvent]:
    """The stretches of the log's labels of these names or sources, in time order.

    Raises:
        ConfigError: the log has no such label.
    """
    missing = [name for name in wanted if not any(is_named(label, [name]) for label in series.annotations)]
    if missing:
        raise ConfigError(
            "the log has no such label",
            where="[detect] true_events",
            found=", ".join(missing),
            expected="some of "
            + (", ".join(dict.fromkeys(label.name for label in series.annotations)) or "none at all"),
            hint="collaudit inspect LOG lists topics; [log] names those that hold labels",
        )
    events = [
        TrueEvent(start, end, dict.fromkeys([label.joint] if label.joint else watched, None), label.joint is None)
        for label in series.annotations
        if is_named(label, wanted)
        for start, end in label.intervals_s
    ]
    return sorted(events, key=lambda e: e.onset_s)
