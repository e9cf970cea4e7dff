"""How long ``collaudit inspect`` takes on a 10 GB MCAP: ``python tests/bench/inspect_huge.py [GIGABYTES] [CHUNK_MB]``.

The file has a real summary, and a real chunk at its start; the chunks between are claimed by the summary and lie
in a hole of the file, so that it takes no room on the disk. It is deleted in the end.
"""

from __future__ import annotations

import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bench_logs_data as data
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap.writer import CompressionType

MAGIC = b"\x89MCAP0\r\n"


def record(op: int, body: bytes) -> bytes:
    """One record."""
    return struct.pack("<BQ", op, len(body)) + body


def text(value: str) -> bytes:
    """A string of a record."""
    return struct.pack("<I", len(value)) + value.encode()


def chunk_index(first: ChunkIndex, number: int, at: int, span: int) -> bytes:
    """The index record of a chunk that lies at another place, its messages later."""
    offsets = b"".join(struct.pack("<HQ", key, at + span - 64) for key in first.message_index_offsets)
    shift = number * (first.message_end_time - first.message_start_time + 1)
    head = struct.pack("<QQQQ", first.message_start_time + shift, first.message_end_time + shift, at, span - 64)
    body = head + struct.pack("<I", len(offsets)) + offsets + struct.pack("<Q", 64) + text(first.compression)
    return record(8, body + struct.pack("<QQ", first.compressed_size, first.uncompressed_size))


def write(path: Path, size: int, span: int) -> int:
    """A file of about ``size`` bytes with chunks of ``span``; how many chunks it claims."""
    source = data.mcap_log(0.2, CompressionType.ZSTD)
    with source.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None and summary.statistics is not None
    first = summary.chunk_indexes[0]
    start = source.read_bytes()[: first.chunk_start_offset + first.chunk_length + first.message_index_length]
    chunks = max(size // span, 1)
    out = bytearray()
    for schema in summary.schemas.values():
        body = struct.pack("<H", schema.id) + text(schema.name) + text(schema.encoding)
        out += record(3, body + struct.pack("<I", len(schema.data)) + schema.data)
    for channel in summary.channels.values():
        body = struct.pack("<HH", channel.id, channel.schema_id) + text(channel.topic) + text(channel.message_encoding)
        out += record(4, body + struct.pack("<I", 0))
    counts = {
        key: value * chunks // len(summary.chunk_indexes)
        for key, value in summary.statistics.channel_message_counts.items()
    }
    body = struct.pack("<QHIIII", sum(counts.values()), len(summary.schemas), len(summary.channels), 0, 0, chunks)
    last = first.message_start_time + chunks * (first.message_end_time - first.message_start_time + 1)
    body += struct.pack("<QQI", first.message_start_time, last, 10 * len(counts))
    out += record(11, body + b"".join(struct.pack("<HQ", key, value) for key, value in counts.items()))
    for number in range(chunks):
        out += chunk_index(first, number, first.chunk_start_offset + number * span, span)
    with path.open("wb") as stream:
        stream.write(start)
        stream.seek(size)
        stream.write(record(15, bytes(4)))
        at = stream.tell()
        stream.write(out)
        footer = struct.pack("<BQQQ", 2, 20, at, 0)
        stream.write(footer + struct.pack("<I", zlib.crc32(bytes(out) + footer)) + MAGIC)
    return chunks


def main(gigabytes: float, chunk_mb: float) -> None:
    """Write the file, inspect it three times, print the times."""
    with tempfile.TemporaryDirectory(prefix="collaudit-huge-") as folder:
        path = Path(folder) / "huge.mcap"
        chunks = write(path, int(gigabytes * 1e9), int(chunk_mb * 1e6))
        command = [str(Path(sys.executable).with_name("collaudit")), "inspect", str(path)]
        times = []
        for _ in range(3):
            start = time.perf_counter()
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            times.append(time.perf_counter() - start)
        print(done.stdout or done.stderr)
        print(f"{path.stat().st_size / 1e9:.3g} GB, {chunks} chunks: {min(times):.3g} s (best of three)")


if __name__ == "__main__":
    given = [float(value) for value in sys.argv[1:]]
    main(*(given + [10.0, 4.0][len(given) :]))
