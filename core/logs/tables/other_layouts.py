"""Tables that are no rows of samples with names of joints above: what a person states, or types, to have them read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from collaudit.core.logs.csv.csv_text import is_number
from collaudit.core.logs.storage.other_formats import python_line
from collaudit.core.logs.storage.table_reader import TableReader
from collaudit.core.logs.tables.column_patterns import MOTION
from collaudit.core.logs.tables.column_vocabulary import meaning_of
from collaudit.core.logs.tables.time_columns import guess_time

#: Columns before the joints' names of a JointState in a line: seconds, nanoseconds, frame.
_HEADER = 3
_MOST_NS = 1_000_000_000


def echoed_keys(reader: TableReader) -> dict[str, object]:
    """The keys that read a JointState as ``ros2 topic echo --csv`` writes it; none for another table.

    A line holds the stamp's seconds and nanoseconds, the frame, then the names, positions, velocities and efforts of
    all joints (ros2topic, ``ros2 topic echo --csv``).
    """
    first = [(reader.first_cells(k) or ("",))[0] for k in range(len(reader.names))]
    stamp = len(first) > _HEADER and first[0].isdigit() and first[1].isdigit() and int(first[1]) < _MOST_NS
    names = 0
    while stamp and _HEADER + names < len(first) and not is_number(first[_HEADER + names]):
        names += 1
    values = first[_HEADER + names :]
    if not names or len(values) != len(MOTION) * names or not all(map(is_number, values)):
        return {}
    begin = _HEADER + names + 1
    columns = {f"log.csv.{q}": list(range(begin + k * names, begin + (k + 1) * names)) for k, q in enumerate(MOTION)}
    joints = {f"joint{k + 1}": first[_HEADER + k] for k in range(names)}
    return {"log.joint_names": joints, "log.csv.time": [1, 2], **columns}


def echoed_lines(keys: Mapping[str, Any]) -> str:
    """Such keys as lines."""
    joints = ", ".join(f"{joint} = {json.dumps(name)}" for joint, name in keys["log.joint_names"].items())
    columns = "; ".join(f"{key.rpartition('.')[2]} = {keys[key]}" for key in keys if key != "log.joint_names")
    return f"[log] joint_names = {{ {joints} }}; [log.csv] {columns}"


def widening_command(reader: TableReader) -> str | None:
    """The command that makes rows of samples of a table with one row a joint and stamp; None for another table."""
    time = guess_time(reader.names) if reader.named else None
    quantities = [name for name in reader.names if (held := meaning_of(name)) is not None and held.quantity in MOTION]
    joint = next((name for k, name in enumerate(reader.names) if _takes_turns(reader.first_cells(k))), None)
    if time is None or joint is None or not any("pos" in name.lower() or name == "q" for name in quantities):
        return None
    wide = f"{reader.path.stem}.wide.csv"
    separator = reader.stated.get("delimiter", ",")
    chosen = {"index": reader.names[time], "columns": joint, "values": quantities}
    pivot = ", ".join(f"{key}={json.dumps(value)}" for key, value in chosen.items())
    code = (
        f"import pandas as pd; long = pd.read_csv({json.dumps(reader.path.name)}, sep={json.dumps(separator)}); "
        f'wide = long.pivot({pivot}); wide.columns = ["_".join(name) for name in wide.columns]; '
        f"wide.to_csv({json.dumps(wide)})"
    )
    return python_line(code)


def _takes_turns(cells: tuple[str, ...]) -> bool:
    """Whether texts come again in the same order."""
    period = len(set(cells))
    return 1 < period <= len(cells) // 2 and not any(map(is_number, cells)) and cells[:-period] == cells[period:]
