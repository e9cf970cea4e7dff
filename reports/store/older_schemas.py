"""Batches of earlier store schemas, read as rows of the one that is written now.

Schema 2 has ``decided_verdict``, ``decided_reasons`` and ``friction_level`` besides; they are null in rows of schema 1.
``friction_excess`` of schema 1 left out what the residual had followed of a friction that changed, so that wear stayed
unseen: what it meant cannot be told afterwards, and it is null.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa

#: Columns of joints in schema 1 that mean something else now.
_MEANT_OTHERWISE = ("friction_excess", "friction_excess_se")


def schema_of(batch: str) -> int:
    """Number of the schema that a batch ``vN/MONTH/NAME`` was written in."""
    return int(batch.partition("/")[0].removeprefix("v"))


def as_latest(part: pa.Table, number: int, schema: pa.Schema) -> pa.Table:
    """Rows of an earlier schema as rows of the latest; what did not exist then is null.

    Args:
        part: rows as read.
        number: their schema.
        schema: columns wanted.
    """
    import pyarrow as pa

    columns = []
    for field in schema:
        values: list[Any] = part.column(field.name).to_pylist() if field.name in part.column_names else []
        if number == 1 and field.name == "joints":
            values = [[item | dict.fromkeys(_MEANT_OTHERWISE) for item in row or ()] for row in values]
        columns.append(pa.array(values or [None] * part.num_rows, field.type))
    return pa.Table.from_arrays(columns, schema=schema)
