"""A configuration for one log: what was found in it, what was given, and guesses marked as such."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from collaudit.cli.drafts.config_text import USUAL_LINES, Line, Section, add_units, document, given_keys
from collaudit.core.api import LogFiles
from collaudit.core.config import LoadedConfig
from collaudit.core.config.describe import all_keys
from collaudit.core.config.schema import CsvConfig
from collaudit.core.findings import Finding
from collaudit.core.logs.log_guess import ColumnGuess
from collaudit.core.logs.log_summary import LogSummary, TopicInfo
from collaudit.core.logs.signals.joint_naming import JointGuess, guess_joints
from collaudit.core.logs.signals.signal_names import counts_message, is_usable
from collaudit.core.logs.tables.column_groups import is_label
from collaudit.core.logs.topics.joint_states_topic import TopicFacts, in_order
from collaudit.core.robot.robot_description import Description
from collaudit.core.small_files import KeyPath

_WRENCH_FRAME = (
    Line("wrench_frame", "ft_sensor", "a frame of the model", active=False),
    Line(
        "wrench_sign",
        1,
        "+1 if the sensor reports the force the robot exerts; -1 if it reports the force acting on the robot",
        active=False,
    ),
)
_NO_ROBOT = "Without a robot only friction can be fitted, from pairs of directions; nothing is judged."


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a log and its robot before a configuration is drafted.

    Attributes:
        files: of the log.
        summary: of it.
        columns: what the names of a table's columns say.
        loaded: what file and flags state.
        robot: the description, None without one.
        paths: key to file as a flag gave it.
        guesses: keys that nobody has stated.
    """

    files: LogFiles
    summary: LogSummary
    columns: ColumnGuess | None
    loaded: LoadedConfig
    robot: Description | None
    paths: dict[str, str]
    guesses: frozenset[KeyPath]

    @property
    def movable(self) -> tuple[str, ...]:
        """Joints of the robot that move on their own; empty without one."""
        return self.robot.movable if self.robot else ()

    @property
    def prismatic(self) -> list[str]:
        """The robot's prismatic joints."""
        return [joint.name for joint in self.robot.joints if joint.kind == "prismatic"] if self.robot else []


class Draft:
    """The file as it grows: sections by name, in the order they are written."""

    def __init__(self, known: Known, folder: Path) -> None:
        self.problems: list[str] = []
        self._known, self.summary = known, known.summary
        self._found = known.columns or ColumnGuess(CsvConfig(), (), {}, {}, {})
        names = [key.dotted for key in all_keys() if key.shape == "table"]
        names.insert(names.index("log") + 1, "log.joint_names")
        self.sections = {name: Section(name, lines=[*USUAL_LINES.get(name, ())]) for name in names}
        self._given = dict(given_keys(known.loaded, folder, known.paths))
        self._fill()

    def _fill(self) -> None:
        topic = self._main_topic()
        if not self._known.movable:
            self.sections["robot"].remarks.append(_NO_ROBOT)
        self._signals(topic)
        self._names(topic)
        add_units(self.sections["log.units"], topic, self._found.units, table=bool(self.summary.csv_columns))
        for dotted, value in self._given.items():
            table, _, key = dotted.rpartition(".")
            if dotted == "log.joint_names" and isinstance(value, dict):
                for name, target in value.items():
                    self._state(dotted, name, target)
            else:
                self._state(table, key, value)

    def _state(self, table: str, key: str, value: object) -> None:
        """Put what a file or flag says in place of a guess or an example; a guess of the file stays one."""
        guess = (*table.split("."), key) in self._known.guesses
        why = "as in the configuration, stated by nobody" if guess else "as given"
        self.sections[table].put(Line(key, value, why, guess=guess))

    def text(self) -> str:
        """The file."""
        head = [
            f"collaudit configuration, written by collaudit init for {self.summary.name}.",
            "Lines marked GUESS were stated nowhere: check each of them. Commented lines (#) are examples.",
            "Every key is explained in docs/config.md.",
        ]
        filled = {name: section for name, section in self.sections.items() if section.lines or section.remarks}
        return document(head, filled)

    def answer(self, section: str, key: str, value: object, why: str) -> None:
        """Put a guess in place of the choices of a key, whose question is answered."""
        own = self.sections[section]
        chosen = [line for line in own.lines if line.key == key]
        own.lines = [line for line in own.lines if line.key != key]
        own.put(Line(key, value, why, guess=True))
        questions = [text for text in own.remarks if text.startswith("QUESTION") and str(chosen[0].value) in text]
        own.remarks = [text for text in own.remarks if text not in questions]
        self.problems = [problem for problem in self.problems if not any(problem in text for text in questions)]

    def remark(self, findings: Sequence[Finding]) -> None:
        """Put findings that concern a setting beside that setting."""
        for finding in findings:
            setting = finding.kind.setting
            if finding.severity == "info" or setting is None:
                continue
            section = self.sections.get(setting) or self.sections.get(setting.rpartition(".")[0])
            if section is not None:
                section.remarks.append(f"{finding.severity}: {finding.text}")
        inverted = {finding.joint: -1 for finding in findings if finding.kind.setting == "log.units.effort_sign"}
        units = self.sections["log.units"]
        if inverted and not any(line.key == "effort_sign" and line.active for line in units.lines):
            why = "these run against the model; uncomment the line if the mounting is right and their effort inverted"
            units.put(Line("effort_sign", inverted, why, active=False))

    def _main_topic(self) -> TopicInfo | None:
        """The table of joint signals: the one asked for, else the one that the ranking of all commands puts first."""
        asked = self._given.get("log.joint_states")
        candidates = {t.name: t for t in self.summary.topics if t.role == "joint_states" and asked in (None, t.name)}
        facts = [
            TopicFacts(
                t.name,
                self._known_joints(t),
                t.signal,
                t.has_position is not False,
                t.has_effort is not False,
                t.effort_noise is not False,
                len(t.joints),
                t.count,
            )
            for t in candidates.values()
        ]
        return candidates[in_order(facts)[0].name] if facts else None

    def _known_joints(self, topic: TopicInfo) -> int:
        """How many of the topic's joints are the robot's, by their names or by a guess."""
        known = sum(name in self._known.movable for name in topic.joints)
        return known + (len(self._guess(topic).mapping) if self._known.movable else 0)

    def _signals(self, topic: TopicInfo | None) -> None:
        log = self.sections["log"]
        if topic is not None and not self.summary.csv_columns:
            rate = "" if topic.rate_hz is None else f", {topic.rate_hz:.4g} Hz"
            others = [t for t in self.summary.topics if t.role == "joint_states" and t.name != topic.name]
            alike = [t.name for t in others if self._known_joints(t) >= self._known_joints(topic)]
            why = f"{topic.type}{rate}, {len(topic.joints)} joints" + "".join(f"; or {name}" for name in alike)
            asked = "log.joint_states" in self._given
            log.add("joint_states", topic.name, why, guess=bool(alike) and not asked)
            if others:
                log.remarks.append(f"Other topics with joint states: {', '.join(t.name for t in others)}.")
            apart = [t for t in others if t.has_effort and is_usable(t.signal) and t.name in alike]
            if topic.has_effort is False and apart and "log.efforts" not in self._given:
                log.add("efforts", apart[0].name, f"{topic.name} has none, and this one has", guess=True)
        if topic is None:
            self._fields()
        for wrench in (t for t in self.summary.topics if t.role == "wrench"):
            log.lines += [Line("wrench", wrench.name, "needs wrench_frame too", active=False), *_WRENCH_FRAME]
        if self.summary.csv_columns:
            self._columns()
        else:
            log.add("time", "auto", "the steadier of header and log time")
        why = "or motor-current, or joint-torque: what is measured; no contact shows in what the controller computes"
        asked = topic is not None and not is_usable(topic.signal) and "log.effort_kind" not in self._given
        if topic is not None and asked:
            self.problems.append(f"{topic.name} is {topic.signal} by its name: are its efforts measured?")
            log.remarks.append(f"QUESTION: {self.problems[-1]} Uncomment effort_kind if they are:")
        log.add("effort_kind", "motor-torque", why, active=False, choice=asked)

    def _fields(self) -> None:
        """Where joint signals may stand in messages of a type that no profile reads: of the topic with most joints."""
        offered = [t for t in self.summary.topics if t.fields and "log.joint_states" not in self._given]
        if not offered:
            return
        first = max(offered, key=lambda t: (len(t.fields), t.count))
        others = "".join(f"; or {t.name}" for t in offered if t is not first)
        self.sections["log"].add("joint_states", first.name, f"{first.type}, read by [log.fields]{others}", guess=True)
        for key, path in first.fields.items():
            self.sections["log.fields"].add(key, path, "by the names of its fields", guess=True)

    def _columns(self) -> None:
        csv, guess = self.sections["log.csv"], self._found.csv
        csv.remarks.append(f"Columns of the file: {', '.join(name for name in self.summary.csv_columns if name)}.")
        csv.remarks.append("In patterns, {joint} stands for a joint's name and {i} counts from 1.")
        examples = {"time": "t", "position": "q{i}", "velocity": "dq{i}", "effort": "tau{i}"}
        open_ = self._open_columns()
        for key, example in examples.items():
            if key in open_:
                continue
            value = getattr(guess, key)
            if value is not None:
                csv.add(key, value, "by its cells" if isinstance(value, list) else "recognised by name", guess=True)
            else:
                csv.add(key, example, "derived from position when absent" if key == "velocity" else "", active=False)
        if guess.time is None:
            csv.add("rate_hz", 1000.0, "rows per second, where there is no time column", active=False)
        labels = [name.strip() for name in self.summary.csv_columns if is_label(name)]
        if labels:
            words = "columns that may mark true events, by the name; see also [detect] true_events"
            self.sections["log"].add("labels", labels, words, active=False)
        self._wrench_columns()
        for key in ("delimiter", "decimal"):
            if (value := getattr(guess, key)) != "auto":
                csv.add(key, value)

    def _wrench_columns(self) -> None:
        """Six columns that are named as a wrench: offered, or said to be no sensor's."""
        offered = self._found.wrench
        if offered is None:
            return
        csv = self.sections["log.csv"]
        if offered.estimated:
            first, last = offered.names[0], offered.names[-1]
            csv.remarks.append(f"Not offered as a sensor, by their names estimated: {first} to {last}.")
            return
        words = "named as a force/torque sensor's: fx, fy, fz, mx, my, mz; needs [log] wrench_frame too"
        csv.add("wrench", list(offered.names), words, active=False)
        self.sections["log"].lines += _WRENCH_FRAME

    def _open_columns(self) -> Mapping[str, Sequence[str]]:
        """Choices for quantities that several groups of columns could be, and a word on what was passed over."""
        csv, found = self.sections["log.csv"], self._found
        for quantity, groups in found.passed_over.items():
            csv.remarks.append(f"Passed over for {quantity}: {', '.join(groups)}.")
        for quantity, patterns in found.open.items():
            motor = len(patterns) == 1
            if motor and "robot.reduction" in self._given:
                csv.add(quantity, patterns[0], "of the motors' side, with [robot] reduction", guess=True)
                continue
            problem = f"several groups of columns could be the measured {quantity}: {', '.join(patterns)}"
            problem = f"the only {quantity} columns are the motors' by their names" if motor else problem
            if f"log.csv.{quantity}" not in self._given:
                self.problems.append(problem)
            answer = (
                "Uncomment the line, and state [robot] reduction = [100.0, …] if they are angles before the gear:"
                if motor
                else "Uncomment the right line:"
            )
            csv.remarks.append(f"QUESTION: {problem}. {answer}")
            for pattern in patterns:
                csv.add(quantity, pattern, choice=True)
        return found.open

    def _names(self, topic: TopicInfo | None) -> None:
        if topic is None or not self._known.movable:
            return
        given = self._given.get("log.joint_names")
        if isinstance(given, dict) and any(name in given for name in topic.joints):
            return
        section, guess = self.sections["log.joint_names"], self._guess(topic)
        if guess.mapping:
            section.remarks.append("Name in the log = name in the robot model.")
        for log, model in guess.mapping.items():
            section.add(log, model, guess.why, guess=True)
        if guess.problem:
            questions = self.sections["log"]
            self.problems.append(guess.problem)
            questions.remarks.append(f"QUESTION: {guess.problem}. Uncomment one line, or write another:")
            for why, mapping in guess.candidates.items():
                questions.add("joint_names", dict(mapping), f"by {why}", choice=True)
            for chain in guess.chains:
                words = "the joints of the robot that the log is of: then its joints are these, in this order"
                self.sections["robot"].add("joints", list(chain), words, choice=True)

    def _guess(self, topic: TopicInfo) -> JointGuess:
        pattern = self._given.get("log.csv.position", self._found.csv.position or "")
        counted = tuple(topic.joints) == tuple(f"joint{k + 1}" for k in range(len(topic.joints)))
        columns = bool(self.summary.csv_columns) and counted and (not isinstance(pattern, str) or "{i" in pattern)
        ordered = columns and isinstance(pattern, str) and counts_message(pattern)
        given = self._given.get("robot.joints")
        return guess_joints(
            topic.joints,
            self._known.movable,
            self._known.prismatic,
            numbered=columns,
            message_order=ordered,
            judged=tuple(given) if isinstance(given, list) else (),
        )
