"""What the recognised columns of one log leave open or contradict, and what they pass over."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.errors import LogError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.joint_naming import listed
from collaudit.core.logs.tables.column_assignment import Assignment
from collaudit.core.logs.tables.column_patterns import QUANTITIES, Found, stated_line
from collaudit.core.logs.tables.file_quantities import AssignedTable, parts_of


def check_columns(files: Sequence[AssignedTable]) -> None:
    """Refuse tables whose column names do not decide what is measured, or whose quantities do not fit together.

    Raises:
        LogError: naming the lines of [log.csv] that decide.
    """
    for file in files:
        for quantity, patterns in file.assignment.open.items():
            message = f"several groups of columns could be the measured {quantity}"
            hint = f"say which: {_line(files, quantity, patterns[0])}"
            if len(patterns) == 1:
                message = f"the only columns of joint {quantity}s are the motors' by their names"
                hint = f"say which side of the gear they are of: {motor_line(_line(files, quantity, patterns[0]))}"
            found = listed(patterns) + _passed_words(file.assignment)
            raise LogError(message, where=str(file.reader.path), found=found, hint=hint)
    positions = [found for _, found in parts_of(files, "position")]
    joints = {joint for found in positions for joint in found.joints}
    for quantity in ("velocity", "effort"):
        parts = [found for _, found in parts_of(files, quantity)]
        own = {joint for found in parts for joint in found.joints}
        numbered = any("{i" in found.pattern for found in (*positions, *parts))
        if not positions or not own or own == joints or (own & joints and not numbered):
            continue
        where = " + ".join(str(file.reader.path) for file in files)
        raise LogError(
            f"the columns of position and of {quantity} are of different joints",
            where=where,
            found=f"position: {_said(positions)}; {quantity}: {_said(parts)}",
            expected="as many columns of each as the log has joints",
            hint=f'name the columns joint by joint: [log.csv] position = ["…", "…"], {quantity} = ["…", "…"]',
        )


def motor_line(line: str) -> str:
    """The two answers to columns of the motors' side.

    Args:
        line: that names the columns.
    """
    return (
        f"{line} where they are already angles of the joints; the same and [robot] reduction = [100.0, …] where they "
        "are the motors' own, with your number of motor turns per turn of each joint"
    )


def left_out_findings(left_out: Sequence[str], rows: int, where: str) -> list[Finding]:
    """Arrays of a file that are as long as signals and have another number of rows than the table."""
    if not left_out:
        return []
    text = f"Arrays that do not have the table's {rows} rows were left out: {listed(left_out)}."
    return [Finding("log-arrays-left-out", "warning", text, where=where)]


def _said(parts: Sequence[Found]) -> str:
    return ", ".join(f"{found.pattern or 'named columns'} ({len(found.columns)} columns)" for found in parts)


def _passed_words(assignment: Assignment) -> str:
    """What else was passed over, so that a refusal shows every group of columns."""
    groups = [group for passed in assignment.passed_over.values() for group in passed]
    return f"; passed over: {', '.join(groups)}" if groups else ""


def _line(files: Sequence[AssignedTable], quantity: str, pattern: str) -> str:
    """The lines of [log.csv]: one that is stated switches the guessing off, so all are."""
    known = {
        name: parts[0][1].pattern for name in QUANTITIES if (parts := parts_of(files, name)) and parts[0][1].pattern
    }
    return stated_line({**known, quantity: pattern})
