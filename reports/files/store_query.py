"""Questions to a store in SQL, answered by DuckDB over Arrow tables."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from collaudit.core.errors import CollauditError, ConfigError
from collaudit.reports.files.result_store import ResultStore

#: So long an interrupted question may take to end before it is interrupted again, s.
_PATIENCE_S = 0.1
#: Tables that a question may name, by what makes them. ``nights`` holds every log once, as last judged.
VIEWS = {
    "nights": """
        SELECT * EXCLUDE (place) FROM (
            SELECT *, rank() OVER (
                PARTITION BY robot, coalesce(log_sha256, night || ' ' || log)
                ORDER BY string_split(batch, '/')[-1] DESC) AS place
            FROM records) WHERE place = 1""",
    "contacts": "SELECT robot, night, log, joint, unnest(c) FROM (SELECT *, unnest(contacts) AS c FROM nights)",
}


@dataclass(frozen=True, slots=True)
class Answer:
    """A table: names of its columns, which of them hold numbers, and rows of values that JSON has words for."""

    columns: tuple[str, ...]
    numeric: tuple[int, ...]
    rows: tuple[tuple[object, ...], ...]

    @property
    def records(self) -> list[dict[str, Any]]:
        """Rows by column name."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]


def query_store(store: ResultStore, sql: str) -> Answer:
    """Answer a question.

    Args:
        store: what it is asked of.
        sql: over the tables in ``VIEWS``, and ``records``, every row that was ever appended.

    Raises:
        ConfigError: the SQL cannot be answered. CollauditError: DuckDB is missing, or the store cannot be read.
    """
    try:
        import duckdb
    except ModuleNotFoundError as error:
        raise CollauditError(
            "questions in SQL need DuckDB", where="collaudit query", hint="python -m pip install 'collaudit[fleet]'"
        ) from error
    connection: Any = duckdb.connect(":memory:", config={"enable_external_access": "false", "threads": "2"})
    try:
        return _apart(lambda: _asked(connection, store.table(), sql), connection.interrupt)
    except duckdb.Error as error:
        raise ConfigError(
            "the SQL cannot be answered",
            where="collaudit query",
            found=str(error).strip(),
            hint=f"tables: {', '.join([*VIEWS, 'records'])}; DESCRIBE nights lists the columns of one",
        ) from error
    finally:
        connection.close()


def _asked(connection: Any, records: pa.Table, sql: str) -> Answer:
    connection.register("records", records)
    for name, view in VIEWS.items():
        connection.execute(f"CREATE VIEW {name} AS {view}")
    found = connection.sql(sql)
    if found is None:
        raise ConfigError("the SQL asks for nothing", where="collaudit query", found=sql, expected="a SELECT")
    return _answer(found.to_arrow_table())


def _apart(work: Callable[[], Answer], interrupt: Callable[[], None]) -> Answer:
    """Done in a thread of its own: DuckDB can swallow the exception of a signal that arrives while it works."""
    pool = ThreadPoolExecutor(1)
    job = pool.submit(work)
    try:
        return job.result()
    finally:
        while not job.done():  # a signal: what has not begun yet is interrupted when it has
            interrupt()
            wait([job], _PATIENCE_S)
        pool.shutdown()


def _answer(found: pa.Table) -> Answer:

    kinds = pa.types
    numeric = [kinds.is_floating(t) or kinds.is_integer(t) or kinds.is_decimal(t) for t in found.schema.types]
    columns = [[_plain(value) for value in column.to_pylist()] for column in found.columns]
    rows = tuple(zip(*columns, strict=True))
    return Answer(tuple(found.column_names), tuple(k for k, number in enumerate(numeric) if number), rows)


def _plain(value: object) -> object:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    return str(value)  # dates, decimals
