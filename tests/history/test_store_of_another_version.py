"""A batch of a schema that is not this version's is refused; nothing of it is taken for something else."""

from __future__ import annotations

from pathlib import Path

import pytest
from histories import history

from collaudit.core.errors import CollauditError
from collaudit.reports.files.result_store import ResultStore


@pytest.mark.parametrize("number", [1, 5])
def test_a_batch_of_another_schema_is_refused(tmp_path: Path, number: int) -> None:
    store = ResultStore(str(tmp_path / "store"))
    store.append(history("cell-1", 2))
    other = tmp_path / "store" / f"v{number}" / "2026-09" / "20260901T000000.000000-00.parquet"
    other.parent.mkdir(parents=True)
    other.write_bytes(b"unknown")
    with pytest.raises(CollauditError, match="another version"):
        store.rows()
