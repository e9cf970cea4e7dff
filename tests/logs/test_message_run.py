"""Messages outside chunks: found many at a time, they are those a walk finds step by step."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import log_writers
import numpy as np
import pytest

from collaudit.core.logs.recordings.mcap_file import McapFile
from collaudit.core.logs.recordings.mcap_records import LEAST_HEAD, MAGIC, MESSAGE, message_run, scan
from collaudit.core.logs.storage.chunked_file import RandomFile


def record(length: int, op: int = MESSAGE, channel: int = 1, fill: int = 0) -> bytes:
    return struct.pack("<BQHIQQ", op, length, channel, 0, 7, 8)[: 9 + length] + bytes([fill]) * max(length - 22, 0)


def step_by_step(window: bytes, at: int) -> tuple[list[int], int]:
    out = []
    while at + LEAST_HEAD <= len(window) and window[at] == MESSAGE:
        out.append(at)
        at += 9 + int.from_bytes(window[at + 1 : at + 9], "little")
    return out, at


def same(window: bytes, at: int = 0) -> int:
    found, after = message_run(window, at)
    expected, end = step_by_step(window, at)
    assert found.tolist() == expected
    assert after == end
    return len(expected)


def turns(rng: np.random.Generator) -> list[int]:
    """Sizes as recorders write them: turns, broken now and then by other topics, turns of another kind."""
    out: list[int] = []
    for _ in range(int(rng.integers(1, 6))):
        turn = rng.integers(22, 90, rng.integers(1, 30)).tolist()
        part = turn * int(rng.integers(1, 200))
        for at in rng.integers(0, len(part), rng.integers(0, 4)).tolist():
            part[at] = int(rng.integers(0, 300))
        out += part
    return out


@pytest.mark.parametrize("seed", range(20))
def test_the_same_as_step_by_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = [record(length, fill=int(rng.integers(0, 256))) for length in turns(rng)]
    for at in rng.integers(0, len(parts), rng.integers(0, 3)).tolist():
        parts[at] = record(30, op=int(rng.integers(0, 16)))
    data = b"".join(parts)
    same(data)
    same(data[: int(rng.integers(0, len(data)))])
    spoilt = bytearray(data)
    for at in rng.integers(0, len(data), 3).tolist():
        spoilt[at] = int(rng.integers(0, 256))
    same(bytes(spoilt))


@pytest.mark.parametrize("claimed", [1 << 20, (1 << 62) + 3, (1 << 64) - 1])
@pytest.mark.parametrize("before", [0, 1, 63, 64, 65, 1000])
def test_a_length_beyond_the_file(before: int, claimed: int) -> None:
    whole = record(50) * before
    data = whole + struct.pack("<BQHIQQ", MESSAGE, claimed, 1, 0, 7, 8) + bytes(40)
    assert same(data) == before + 1


def test_bytes_that_are_all_the_same() -> None:
    for value in (0, MESSAGE, 255):
        same(bytes([value]) * 4096)
    assert same(record(0) * 3000) > 2900


def index_of(path: Path, lengths: Sequence[int], tail: bytes = b"") -> tuple[list[int], list[str]]:
    """Messages in each run of them, and damage."""
    path.write_bytes(MAGIC + b"".join(record(length) for length in lengths) + tail)
    file = RandomFile(path)
    found = scan(file)
    file.close()
    return [chunk.loose.shape[0] for chunk in found.chunks if chunk.loose is not None], [
        item.text for item in found.damage
    ]


def test_short_and_cut_messages_are_named(tmp_path: Path) -> None:
    lengths = [40] * 300 + [21] + [40] * 300
    counts, damage = index_of(tmp_path / "a.mcap", lengths)
    assert sum(counts) == 600
    assert f"the message at byte {8 + 300 * 49} is only 21 bytes long" in damage
    counts, damage = index_of(tmp_path / "b.mcap", [40] * 100, record(1000)[:60])
    assert counts == [100]
    assert damage == [f"it ends at byte {8 + 4900 + 60}, inside a record that should reach byte {8 + 4900 + 1009}"]


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
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + b"".join(record(40) + between for _ in range(5000)))
    file = RandomFile(path)
    runs = [chunk.loose for chunk in scan(file).chunks]
    file.close()
    assert len(runs) <= 2
    assert sum(run.shape[0] for run in runs if run is not None) == 5000
    reader = McapFile(path)
    assert list(reader.batches()) == []  # of a channel that is not defined
    assert len(reader.damage) == 2
    reader.close()
