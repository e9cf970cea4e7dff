"""Tables to a :class:`JointLog`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isnan

import numpy as np

from collaudit.core.config.schema import LogConfig, UnitsConfig
from collaudit.core.data.joint_log import Annotation, Digest, JointLog, LogSource, WrenchSeries
from collaudit.core.errors import LogError
from collaudit.core.findings import Finding, fact
from collaudit.core.logs.signals.annotation_spans import (
    absent_labels,
    annotation_findings,
    mode_annotations,
    phases_of,
    spans_of,
)
from collaudit.core.logs.signals.joint_naming import listed, map_names
from collaudit.core.logs.signals.joint_values import check_joint_keys, to_si, with_currents
from collaudit.core.logs.signals.sample_clock import interpolate, start_of
from collaudit.core.logs.signals.signal_names import QUANTITIES
from collaudit.core.logs.storage.bounded_reading import ReadingBounds
from collaudit.core.logs.storage.readers import TableReader
from collaudit.core.logs.tables.column_roles import UNITS, standard_unit
from collaudit.core.logs.tables.joined_tables import JointTable, join_tables
from collaudit.core.numeric.arrays import BoolArray, FloatArray, frozen

#: What a cell says while an annotation does not hold, in lower case; a number says so by being zero or none.
_NO = frozenset({"", "false", "no", "off", "none", "null", "-"})


def read_table_log(
    readers: Sequence[TableReader],
    name: str,
    settings: LogConfig,
    robot_joints: Sequence[str] | None,
    prismatic: Sequence[str],
    judged: Sequence[str],
    digest: Digest,
    bounds: ReadingBounds,
) -> JointLog:
    """Read one log from tables.

    Args:
        readers: the tables, those of ``[log.csv] also`` among them.
        name: of the log, for messages and its source.
        settings, robot_joints, prismatic, judged: as of :func:`collaudit.core.logs.log_reading.read_log`.
        digest: hash of the log.
        bounds: how much may be read.

    Raises:
        LogError, ConfigError: as of :func:`collaudit.core.logs.log_reading.read_log`.
    """
    table = join_tables(readers, settings, robot_joints or ())
    if table.obstacle is not None:
        raise LogError(f"{table.obstacle.code}: {table.obstacle.text}", where=name)
    bounds.take_values(table.time_s.size, 1 + sum(values.shape[1] for values in table.columns.values()))
    _check_stated(table, settings, name)
    names = list(table.names)
    kept = map_names(
        names,
        settings.joint_names,
        robot_joints,
        name,
        prismatic,
        numbered=table.numbered,
        columns=table.numbered,
        message_order=table.message_order,
        judged=judged,
    )
    check_joint_keys(settings.units, [*names, *kept.model, *(robot_joints or ())])
    picked = [names.index(log) for log in kept.log]
    stated = with_currents(settings.units, name) if settings.effort_kind == "motor-current" else settings.units
    units, unit_findings = _units(table, stated, name)
    columns = dict(table.columns)
    table.columns.clear()
    if picked != list(range(len(names))):
        columns = {quantity: np.asfortranarray(values[:, picked]) for quantity, values in columns.items()}
    time_s, texts = table.time_s, table.texts
    samples, said = joint_samples(time_s, columns, name)
    if samples is not None:
        texts = {column: held_words(words, samples) for column, words in texts.items()}
        time_s = time_s[samples]
    annotations, phases, annotations_missing = _annotations(texts, table.time_s, settings, name)
    unit = to_si(columns, kept, units, prismatic, name)
    findings = [*table.findings, *said, *unit_findings, *kept.findings]
    findings += [*annotations_missing, *annotation_findings(annotations)]
    if "effort" not in columns:
        findings.append(Finding("log-effort-missing", "warning", "The table has no effort columns.", where=name))
    return JointLog(
        time_s=frozen(time_s),
        joint_names=kept.model,
        position_rad=frozen(columns["position"]),
        velocity_rad_s=frozen(columns["velocity"]) if "velocity" in columns else None,
        effort=frozen(columns["effort"]) if "effort" in columns else None,
        effort_unit=unit,
        wrench=None if table.wrench is None else _wrench(table.time_s, table.wrench, name),
        source=LogSource(
            name=name,
            digest=digest,
            format=readers[0].format,
            start_ns=start_of(table.start_ns) if table.start_ns is not None else None,
            time_source="column" if settings.csv.row_period_s is None else "rate",
            topic=name,
        ),
        findings=tuple(findings),
        annotations=tuple(annotations),
        phases=tuple(phases),
        temperature_c=frozen(columns["temperature"]) if "temperature" in columns else None,
        joint_torque_nm=frozen(columns["joint_torque"]) if "joint_torque" in columns else None,
    )


def _wrench(time_s: FloatArray, wrench: FloatArray, name: str) -> WrenchSeries:
    """The wrench (n, 6) on the stamps (n,) of the rows that hold one."""
    held = np.isfinite(wrench).any(axis=1)
    if not held.all():
        time_s, wrench = time_s[held], wrench[held]
    return WrenchSeries(frozen(time_s), frozen(wrench), name)


def _check_stated(table: JointTable, settings: LogConfig, where: str) -> None:
    """Refuse a table without columns that the configuration names."""
    stated = {f"[log.csv] {quantity}": getattr(settings.csv, quantity) for quantity in (*QUANTITIES, "wrench")}
    held = [*(quantity in table.columns for quantity in QUANTITIES), table.wrench is not None]
    for (key, columns), present in zip(
        {**stated, "[log] phase": settings.phase}.items(), [*held, settings.phase in table.texts], strict=True
    ):
        if columns is not None and not present:
            raise LogError(
                f"the table has no columns {columns!r}",
                where=f"{where}, {key}",
                hint="collaudit inspect LOG lists the columns; correct the name, or take it out",
            )


def _units(table: JointTable, stated: UnitsConfig, where: str) -> tuple[UnitsConfig, list[Finding]]:
    """Units by the configuration, else by the column names, else the defaults, which is said.

    Raises:
        LogError: the names state a unit that is not converted, and the configuration says nothing.
        ConfigError: the names say that efforts are currents, and there are no torque constants.
    """
    update: dict[str, object] = {}
    findings: list[Finding] = []
    for quantity in ("position", "velocity", "effort"):
        named = table.units.get(quantity, "")
        if quantity in stated.given or quantity not in table.columns:
            continue
        if named:
            update[quantity] = _converted(quantity, named, where)
        elif quantity == "effort":
            text = "The unit of the effort columns is not stated; it was taken as N·m."
            findings.append(Finding("log-guessed", "warning", text, where=where))
    if update.get("effort") == "A":
        stated = with_currents(stated, where)
    return stated.changed(update), findings


def _converted(quantity: str, named: str, where: str) -> str:
    unit = standard_unit(quantity, named)
    if unit is None:
        raise LogError(
            f"the {quantity} columns are in a unit that is not converted",
            where=where,
            found=f"{named} in their names",
            expected=listed(tuple(UNITS[quantity])),
            hint="convert the columns; or, if the name does not tell their unit, state it: "
            f"[log.units] {quantity} = {' or '.join(map(json.dumps, UNITS[quantity]))}",
        )
    return unit


def _annotations(
    texts: Mapping[str, tuple[str, ...]], time_s: FloatArray, settings: LogConfig, where: str
) -> tuple[list[Annotation], list[Annotation], list[Finding]]:
    """Annotations and phases of a table, and what of them cannot be used.

    Args:
        texts: column name to the text of each row.
        time_s: (n,) stamps; rows whose stamp is not a number are left out.
        settings: which columns are annotations and which is the phase.
        where: the file, for findings.
    """
    absent = [name for name in settings.labels if name not in texts]
    findings = absent_labels(absent, "[log] labels", where)
    if not texts:
        return [], [], findings
    good = np.flatnonzero(np.isfinite(time_s))
    good = good[np.argsort(time_s[good], kind="stable")]
    stamps = time_s[good]
    annotations = mode_annotations(texts, good, stamps, where)
    for name in settings.labels:
        if name in texts:
            holds = np.array([_holds(text) for text in texts[name]], dtype=np.bool_)
            annotations.append(Annotation(name, where, tuple(spans_of(stamps, holds[good]))))
    phases: list[Annotation] = []
    if settings.phase is not None and good.size:
        words = [texts[settings.phase][k].strip() for k in good.tolist()]
        phases, refused = phases_of(stamps, words, float(stamps[-1]), f"{where}, column {settings.phase}")
        findings += refused
    return annotations, phases, findings


def _holds(text: str) -> bool:
    """Whether a cell says that an annotation holds; numbers are compared as numbers, however they are written."""
    word = text.strip().lower()
    try:
        number = float(word)
    except ValueError:
        return word not in _NO
    return bool(number) and not isnan(number)


#: A quantity stands on rows of its own where so few of its rows have positions: two topics have the same stamp now and
#: then. A quantity with missing values shares the rows that it has.
_SHARED = 0.05


def joint_samples(
    time_s: FloatArray, columns: dict[str, FloatArray], where: str
) -> tuple[BoolArray | None, list[Finding]]:
    """Leave the rows that are samples in the columns of joints, and bring quantities on other rows to these.

    Between the first and the last row with a value of a joint, rows without any are no samples, as if they were not in
    the file. Before and behind they stay: time in which the joints were lost.

    Args:
        time_s: (n,) stamps.
        columns: quantity to (n, j), NaN where a cell is empty; changed in place to (m, j).
        where: the file, for findings.

    Returns:
        (n,) the m rows that are samples, None where all are; and what is to be said.
    """
    if not np.isnan(columns["position"][:, 0]).any():
        return None, []
    filled = {quantity: np.isfinite(values).any(axis=1) for quantity, values in columns.items()}
    shared = {quantity: np.count_nonzero(filled[quantity] & filled["position"]) for quantity in filled}
    apart = sorted(q for q in filled if filled[q].any() and shared[q] <= _SHARED * np.count_nonzero(filled[q]))
    held = np.logical_or.reduce([filled[quantity] for quantity in filled if quantity not in apart])
    if not held.any() or held.all():
        return None, []
    first, last = np.flatnonzero(held)[[0, -1]]
    empty = ~np.logical_or.reduce([*filled.values()])
    empty[first:last] = False
    samples = held | empty
    for quantity, values in columns.items():
        own = filled[quantity]
        at = interpolate(time_s[samples], time_s[own], values[own]) if quantity in apart else values[samples]
        columns[quantity] = np.asfortranarray(at)
    left_out = int(np.count_nonzero(~samples))
    text = f"{left_out} of {held.size} rows hold no sample of the joints, but other signals or nothing."
    if apart:
        text += f" Rows of its own has: {', '.join(apart)}; its values were brought to the stamps of the positions."
    return samples, [fact(text, where=where)] if left_out else []


def held_words(words: Sequence[str], samples: BoolArray) -> tuple[str, ...]:
    """Text of each row, of rows that are no samples the last before where they have none.

    Args:
        words: n texts; samples: (n,).
    """
    out, last = [], ""
    for word, sample in zip(words, samples.tolist(), strict=True):
        last = word if sample or word.strip() else last
        out.append(last)
    return tuple(out)
