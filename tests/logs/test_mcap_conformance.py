"""The features an MCAP writer may use or leave out: from whatever combination the same log is read, nothing is missed.

The options are those of the format's own conformance tests, of the official writer. Padding at the end of records and
records of unknown kind, which the writer does not make, are added to what it writes.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import log_writers as w
import numpy as np
import pytest
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import IndexType, Writer

from collaudit.core.config.schema import LogConfig
from collaudit.core.data.joint_log import JointLog
from collaudit.core.logs.log_description import describe
from collaudit.core.logs.log_reading import read_log
from collaudit.core.logs.messages import mcap_file
from collaudit.core.logs.messages.mcap_file import McapFile, overview_of
from collaudit.core.numeric import parallel

COUNT = 12
MESSAGES = w.motion(COUNT)
PAYLOADS = [w.encode(said, "cdr") for said in MESSAGES]
OPTIONS = ("repeat_channels", "repeat_schemas", "use_statistics", "use_summary_offsets", "enable_crcs")
INDEXES = (IndexType.NONE, IndexType.MESSAGE, IndexType.CHUNK, IndexType.ALL)
SETTINGS = LogConfig(wrench="/ft/wrench")


def write(path: Path, compression: str | None, index: IndexType, extras: bool, options: dict[str, bool]) -> Path:
    """Chunks hold a few messages each; without compression stated, there are none."""
    with path.open("wb") as stream:
        writer = Writer(
            stream, chunk_size=2000, compression=w.COMPRESSION[compression or ""], index_types=index,
            use_chunking=compression is not None, enable_data_crcs=options["enable_crcs"], **options,
        )  # fmt: skip
        writer.start(profile="ros2")
        channels: dict[str, int] = {}
        for number, (said, payload) in enumerate(zip(MESSAGES, PAYLOADS, strict=True)):
            if said.topic not in channels:
                schema = writer.register_schema(said.type, "ros2msg", w.definition(said.type, "cdr").encode())
                channels[said.topic] = writer.register_channel(said.topic, "cdr", schema, {"offered_qos_profiles": ""})
            if extras and number % 5 == 0:
                writer.add_attachment(
                    said.log_ns, said.log_ns, "calibration.bin", "application/octet-stream", b"\x06" * 50
                )
                writer.add_metadata("operator", {"shift": "night"})
            writer.add_message(channels[said.topic], said.log_ns, payload, said.log_ns, number)
        writer.finish()
    return path


def combinations(which: int) -> Iterator[dict[str, bool]]:
    """A quarter of all, in which every two options meet in each way; the four quarters, by number, are all of them."""
    for a, b, c in product((0, 1), repeat=3):
        values = (a, b, c, a ^ b ^ (which & 1), a ^ c ^ (which >> 1 & 1))
        yield dict(zip(OPTIONS, map(bool, values), strict=True))


def read(path: Path) -> JointLog:
    return read_log((path,), SETTINGS, robot_joints=None)


def check(path: Path, reference: JointLog, case: object) -> None:
    log = read(path)
    assert log.joint_names == reference.joint_names, case
    for name in ("time_s", "position_rad", "velocity_rad_s", "effort"):
        np.testing.assert_array_equal(getattr(log, name), getattr(reference, name), err_msg=str(case))
    assert log.wrench is not None and reference.wrench is not None
    np.testing.assert_array_equal(log.wrench.wrench, reference.wrench.wrench, err_msg=str(case))
    assert log.findings == reference.findings, case


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> JointLog:
    return read(w.write_mcap(tmp_path_factory.mktemp("plain") / "log.mcap", MESSAGES))


@pytest.mark.parametrize("extras", [False, True], ids=["", "attachments"])
@pytest.mark.parametrize("index", INDEXES, ids=lambda index: f"index-{index.name}")
@pytest.mark.parametrize("compression", [None, "", "lz4", "zstd"], ids=["unchunked", "none", "lz4", "zstd"])
def test_every_combination(
    compression: str | None, index: IndexType, extras: bool, tmp_path: Path, reference: JointLog
) -> None:
    forms = (None, "", "lz4", "zstd").index(compression)  # every pair of forms and indexes meets two of the quarters
    for options in combinations((forms + INDEXES.index(index) + 2 * extras) % 4):
        path = write(tmp_path / "log.mcap", compression, index, extras, options)
        check(path, reference, options)
        overview = overview_of(path)
        if overview is not None:
            assert {channel.type for channel in overview.reader.channels} == {w.JOINT_STATE, w.WRENCH}, options
            assert sum(overview.counts.values()) == 2 * COUNT
            overview.reader.close()


def test_schemas_that_stand_only_in_chunks(tmp_path: Path) -> None:
    options = dict.fromkeys(OPTIONS, True) | {"repeat_schemas": False}
    path = write(tmp_path / "log.mcap", "zstd", IndexType.ALL, False, options)
    reader = McapFile(path)
    assert {channel.type for channel in reader.channels} == {w.JOINT_STATE, w.WRENCH}
    assert all(channel.schema for channel in reader.channels)
    reader.close()
    assert all(topic.readable for topic in describe((path,)).topics)


@pytest.mark.parametrize("compression", [None, "", "zstd"], ids=["unchunked", "none", "zstd"])
@pytest.mark.parametrize("index", INDEXES, ids=lambda index: f"index-{index.name}")
def test_padded_records_and_unknown_ones(
    compression: str | None, index: IndexType, tmp_path: Path, reference: JointLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin, finish = RecordBuilder.start_record, RecordBuilder.finish_record
    padded = {
        Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.SUMMARY_OFFSET,
        Opcode.METADATA_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.DATA_END, Opcode.METADATA, Opcode.MESSAGE_INDEX,
    }  # fmt: skip
    now: list[Opcode] = []

    def started(self: RecordBuilder, opcode: Opcode) -> None:
        now.append(opcode)
        begin(self, opcode)

    def finished(self: RecordBuilder) -> None:
        if now[-1] in padded:
            self.write(b"\x01\x02\x03\x04")
        finish(self)
        if now[-1] in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA):
            self.write(struct.pack("<BQ", 0x81, 7) + b"unknown")

    monkeypatch.setattr(RecordBuilder, "start_record", started)
    monkeypatch.setattr(RecordBuilder, "finish_record", finished)
    for options in combinations(INDEXES.index(index)):
        options = options | {"enable_crcs": False}
        path = write(tmp_path / "log.mcap", compression, index, True, options)
        assert b"unknown" in path.read_bytes() or compression == "zstd"
        check(path, reference, options)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("window", [31, 700, 1500])
def test_loose_messages_are_read_in_windows_by_several_threads(
    window: int, threads: int, tmp_path: Path, reference: JointLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "log.mcap", None, IndexType.ALL, True, dict.fromkeys(OPTIONS, True))
    monkeypatch.setattr(mcap_file, "_WINDOW", window)
    monkeypatch.setattr(parallel, "_threads", threads)
    check(path, reference, window)
    with path.open("r+b") as file:  # what is cut while it is read is said once, and what lies before is read
        reader = McapFile(path)
        last = reader.chunks[-1]
        assert last.at == last.data_at
        file.truncate(last.at + last.size - 1)
    assert sum(batch.start.shape[0] for batch in reader.batches()) < 2 * COUNT
    assert [item.text for item in reader.damage if "is damaged" in item.text] == [reader.damage[0].text]
    reader.close()


@pytest.mark.parametrize("lost", [[], [0], [5], [39], [0, 1, 2, 38, 39], [*range(40)]])
def test_messages_that_the_index_lacks_are_found(lost: list[int]) -> None:
    sizes = np.random.default_rng(1).integers(22, 60, 40)
    records = [struct.pack("<BQHIQQ", 5, size, k % 3, 0, k, k) + bytes(int(size) - 22) for k, size in enumerate(sizes)]
    starts = np.cumsum([0, *(len(record) for record in records)])[:-1]
    schema = struct.pack("<BQ", 3, 4) + bytes(4)
    data = b"".join(records[:7]) + schema + b"".join(records[7:]) + b"\x05rest"
    starts[7:] += len(schema)
    found = mcap_file.locate(data, np.delete(starts, lost))
    np.testing.assert_array_equal(found.log_ns, np.arange(40))
    np.testing.assert_array_equal(found.start, starts + 31)
    assert found.problem == "5 of its bytes are no record" and found.others == [(3, bytes(4))]
    wrong = mcap_file.locate(data, np.delete(starts, lost) + 1)
    np.testing.assert_array_equal(wrong.start, found.start)
