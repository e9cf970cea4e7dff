"""``collaudit query``: SQL over a store of results."""

from __future__ import annotations

import click

from collaudit.cli.console import say, say_object, terminal_width
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_PASS


@example_command(
    "query",
    "collaudit query store/ \"SELECT robot, count(DISTINCT log) FROM nights WHERE verdict = 'fail' GROUP BY robot\"",
    'collaudit query store/ "SELECT night, joint, friction_nm FROM nights ORDER BY night" --json',
    'collaudit query s3://bucket/store "DESCRIBE nights"',
)
@click.argument("store", metavar="STORE")
@click.argument("sql", metavar="SQL")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: columns, and rows as lists.")
def command(store: str, sql: str, as_json: bool) -> int:
    """Answer a question in SQL from a store that collaudit audit --store keeps.

    Tables: nights (a row for each joint of each log, as it was last judged), contacts (a row for each joint in each
    contact), and records (every row that was ever appended). docs/fleet.md lists their columns and answers five
    questions. Nothing can be changed, and no other file be read.

    Needs DuckDB: python -m pip install 'collaudit[fleet]'.
    """
    from collaudit.reports.store.result_store import ResultStore
    from collaudit.reports.store.store_query import query_store
    from collaudit.reports.terminal.text_table import table

    found = query_store(ResultStore(store), sql)
    if as_json:
        say_object("collaudit/query/1", {"columns": found.columns, "rows": found.rows}, indent=1)
        return EXIT_PASS
    lines = [[_shown(value) for value in row] for row in found.rows]
    say(table(found.columns, lines, found.numeric, terminal_width()), nl=False)
    return EXIT_PASS


def _shown(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
