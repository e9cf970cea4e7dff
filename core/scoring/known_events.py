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
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.annotation_spans import absent_labels
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.scoring.detection_score import JudgedResidual, TrueEvent, TruthFile, score, true_events


def score_detection(
    series: UniformSeries, run: DetectorRun, inputs: DetectionInputs, config: DetectConfig, truth: TruthFile | None
) -> tuple[Score, ...]:
    """Score a detector against the known events; empty when none are known, as in a log without such a label.

    Args:
        series: the judged joints.
        run: what the detector made of them.
        inputs: the rule and the watched joints.
        config: labels of the log that mark true events.
        truth: a truth file or table of labels, which wins over the log's own.

    Raises:
        LogError: the file cannot be understood.
    """
    labels = [label for label in series.annotations if is_named(label, config.true_events)]
    if truth is None and not labels:
        return ()
    watched = inputs.rule.watch
    joints = watched or series.joint_names  # of no watched joint: they happened, and none could be observed
    if truth is not None:
        events = true_events(truth, joints)
    else:
        events = [
            TrueEvent(start, end, dict.fromkeys([label.joint] if label.joint else joints, None), label.joint is None)
            for label in labels
            for start, end in label.intervals_s
        ]
    ratio = run.residual.torque_nm / run.gamma_nm
    judged = JudgedResidual(series.time_s, ratio, run.detected.state, series.joint_names, inputs.rule.n)
    return tuple(s for s in score(events, run.detected.collisions, judged) if s.joint is None or s.joint in watched)


def known_contact_times(
    prepared: Sequence[Prepared], config: Config, truth: Sequence[TruthFile | None]
) -> list[list[tuple[float, float]] | None]:
    """For each log the start and end of its known contacts, s; None where they are not known and are to be looked for.

    Args:
        prepared: the logs.
        config: ``[fit] contact`` and the labels of ``[detect] true_events``.
        truth: for each log a truth file or table of labels, which wins over the log's own labels.

    Raises:
        LogError: a file cannot be understood.
        ConfigError: contacts are stated to be labelled, and a log has no such label.
    """
    wanted, how = config.detect.true_events, config.fit.contact
    if how == "labelled" and not wanted and not any(truth):
        raise ConfigError(
            "no labels are named that mark contact",
            where="[fit] contact",
            found='"labelled" without [detect] true_events and without a truth file',
            hint="name the labels in [detect] true_events, or give --truth",
        )
    out: list[list[tuple[float, float]] | None] = []
    for log, file in zip(prepared, [*truth, *[None] * (len(prepared) - len(truth))], strict=True):
        if file is not None:
            out.append(contact_times(file, log.judged))
            continue
        times = label_times(log.series.annotations, wanted) if how != "none" else None
        if times is None and how == "labelled":
            names = dict.fromkeys(label.name for label in log.series.annotations)
            raise ConfigError(
                "the log has no such label",
                where='[fit] contact = "labelled"',
                found=", ".join(wanted),
                expected="some of " + (", ".join(names) or "none at all"),
                hint="collaudit inspect LOG lists topics; [log] names those that hold labels",
            )
        out.append(times)
    return out


def contact_times(truth: TruthFile, joints: Sequence[str]) -> list[tuple[float, float]]:
    """Start and end of all events of a truth file or table of labels, s.

    Raises:
        LogError: it cannot be understood.
    """
    return [(event.onset_s, event.end_s) for event in true_events(truth, joints)]


def label_times(labels: Sequence[Annotation], wanted: Sequence[str]) -> list[tuple[float, float]] | None:
    """Start and end of what a log's labels of these names or sources mark, s; None without such a label."""
    marks = [label for label in labels if is_named(label, wanted)]
    return sorted(interval for label in marks for interval in label.intervals_s) if marks else None


def missing_labels(series: UniformSeries, config: Config) -> list[Finding]:
    """That the log lacks labels which mark true events; of columns and topics of labels its reader says so."""
    names = [name for name in config.detect.true_events if name not in config.log.labels]
    absent = [name for name in names if not any(is_named(one, [name]) for one in series.annotations)]
    return absent_labels(absent, "[detect] true_events", series.source.name)
