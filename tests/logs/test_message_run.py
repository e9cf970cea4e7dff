"""Messages outside chunks: they are found as those of a chunk, and what is wrong among them is said."""

from __future__ import annotations

import struct
from pathlib import Path

import log_writers
import pytest

from collaudit.core.logs.messages.mcap_file import MAGIC, MESSAGE, McapFile

#: A channel without a schema: number 1, topic "a", encoding "x".
CHANNEL = struct.pack("<BQHHI", 4, 18, 1, 0, 1) + b"a" + struct.pack("<I", 1) + b"x" + bytes(4)
START = len(MAGIC + CHANNEL)


def record(length: int, op: int = MESSAGE, channel: int = 1, fill: int = 0) -> bytes:
    return struct.pack("<BQHIQQ", op, length, channel, 0, 7, 8)[: 9 + length] + bytes([fill]) * max(length - 22, 0)


def read(path: Path, data: bytes) -> tuple[list[int], list[str]]:
    """Bytes of each run of messages, and damage."""
    path.write_bytes(MAGIC + CHANNEL + data)
    reader = McapFile(path)
    count = sum(batch.start.shape[0] for batch in reader.batches())
    reader.close()
    return [count, *(chunk.size for chunk in reader.chunks)], [item.text for item in reader.damage]


@pytest.mark.parametrize("claimed", [1 << 20, (1 << 62) + 3, (1 << 64) - 1])
@pytest.mark.parametrize("before", [0, 1, 63, 64, 65, 1000])
def test_a_length_beyond_the_file(before: int, claimed: int, tmp_path: Path) -> None:
    cut = struct.pack("<BQHIQQ", MESSAGE, claimed, 1, 0, 7, 8) + bytes(40)
    (count, *_), damage = read(tmp_path / "a.mcap", record(50) * before + cut)
    assert count == before
    assert damage == [f"it ends at byte {START + 59 * before + 71}, inside the record at byte {START + 59 * before}"]


def test_bytes_that_are_all_the_same(tmp_path: Path) -> None:
    for value in (0, MESSAGE, 255):
        (count, *_), damage = read(tmp_path / "a.mcap", bytes([value]) * 4096)
        assert count == 0 and damage
    (count, *_), damage = read(tmp_path / "b.mcap", record(0) * 3000)
    assert count == 0 and any(f"{9 * 3000} of its bytes are no record" in text for text in damage)


def test_short_and_cut_messages_are_said(tmp_path: Path) -> None:
    parts = [record(40)] * 300 + [record(21)] + [record(40)] * 300
    (count, *_), damage = read(tmp_path / "a.mcap", b"".join(parts))
    assert count == 600
    assert any("30 of its bytes are no record; 600 of its messages were read" in text for text in damage)
    (count, *_), damage = read(tmp_path / "b.mcap", record(40) * 100 + record(1000)[:60])
    assert count == 100
    assert damage == [f"it ends at byte {START + 4900 + 60}, inside the record at byte {START + 4900}"]


def test_a_file_that_shrinks_while_it_is_read_is_partial(tmp_path: Path) -> None:
    path = log_writers.write_any(
        tmp_path, "mcap-unchunked", lambda encoding: log_writers.motion(200, encoding=encoding)
    )
    reader = McapFile(path)
    whole = sum(batch.start.shape[0] for batch in reader.batches())
    assert whole and not reader.damage
    with path.open("r+b") as stream:
        stream.truncate(path.stat().st_size // 2)
    assert sum(batch.start.shape[0] for batch in reader.batches()) < whole
    assert any("is damaged" in item.text for item in reader.damage)
    reader.close()


def test_messages_between_small_records_are_few_runs(tmp_path: Path) -> None:
    between = struct.pack("<BQ", 0x0A, 5) + bytes(5)
    (count, *runs), damage = read(tmp_path / "a.mcap", (record(40) + between) * 5000)
    assert count == 5000 and len(runs) <= 2
    assert len(damage) == 1  # it has no footer
