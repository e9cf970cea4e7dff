"""What is known about a log's events from outside the residual: true events to score by, the controller's alarms."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.contacts.controller_alarms import is_named
from collaudit.core.data.detection_result import Score
from collaudit.core.data.joint_log import Annotation
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.errors import ConfigError
from collaudit.core.prepare.prepared import Prepared
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


def known_contact_times(
    prepared: Sequence[Prepared], config: Config, truth: Sequence[TruthFile | None]
) -> list[list[tuple[float, float]] | None]:
    """For each log the start and end of its known contacts, s; None where they are not known and are to be looked for.

    Args:
        prepared: the logs.
        config: ``[fit] contact`` and the labels of ``[detect] true_events``.
        truth: for each log a truth file or table of labels, which wins over the log's own labels.

    Raises:
        LogError, ConfigError: as :func:`score_detection` does.
    """
    wanted, how = config.detect.true_events, config.fit.contact
    if how == "labelled" and not wanted and not any(truth):
        raise ConfigError(
            "no labels are named that mark contact",
            where="[fit] contact",
            found='"labelled" without [detect] true_events and without a truth file',
            hint="name the labels by --labels, or give --truth",
        )
    out: list[list[tuple[float, float]] | None] = []
    for log, file in zip(prepared, [*truth, *[None] * (len(prepared) - len(truth))], strict=True):
        has = any(is_named(label, wanted) for label in log.series.annotations)
        if file is not None:
            out.append(contact_times(file, log.judged))
        elif how == "labelled" or (how == "find" and wanted and has):
            labelled_events(log.judged_series, log.judged, wanted)  # refuses a label that the log has not
            out.append(label_times(log.series.annotations, wanted))
        else:
            out.append(None)
    return out


def contact_times(truth: TruthFile, joints: Sequence[str]) -> list[tuple[float, float]]:
    """Start and end of all events of a truth file or table of labels, s.

    Raises:
        LogError: it cannot be understood.
    """
    return [(event.onset_s, event.end_s) for event in true_events(truth, joints)]


def label_times(labels: Sequence[Annotation], wanted: Sequence[str]) -> list[tuple[float, float]]:
    """Start and end of the stretches that a log's labels of these names or sources mark, s."""
    return sorted(interval for label in labels if is_named(label, wanted) for interval in label.intervals_s)


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
