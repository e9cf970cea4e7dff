"""Coverage-guided fuzzing of the readers of chunks, records and CDR messages, by Atheris (libFuzzer).

``python tests/bench/fuzz_coverage.py TARGET CORPUS [libFuzzer's options]`` with one of the targets ``mcap-chunk``,
``bag-chunk``, ``mcap-records``, ``bag-records``, ``cdr``, ``ros1``. Needs the package ``atheris``, which nothing else
needs. Whatever a reader raises other than its own errors, and every place it names outside the bytes, is a crash.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["collaudit.core.logs"]):
    from collaudit.core.logs.messages import bag_file, column_extraction, layout, mcap_file
    from collaudit.core.logs.messages.message_schema import parse_schema
    from collaudit.core.logs.storage.readers import Channel
    from collaudit.core.logs.topics.log_topics import profile_of

import numpy as np

from collaudit.core.errors import LogError

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))
import log_writers as w

SCRATCH = Path(tempfile.mkdtemp(prefix="collaudit-atheris-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))


def split(data: bytes) -> tuple[bytes, np.ndarray]:
    """Bytes of a chunk, and the offsets its index claims: the first byte says how many four-byte words they are."""
    count = data[0] if data else 0
    words = data[1 : 1 + 4 * count]
    offsets = np.frombuffer(words[: len(words) // 4 * 4], dtype="<i4").astype(np.int64)
    return data[1 + 4 * count :], offsets


def mcap_chunks(data: bytes) -> None:
    chunk, offsets = split(data)
    found = mcap_file.locate(chunk, offsets)
    assert (found.start >= 0).all() and (found.length >= 0).all()
    assert not found.start.size or int((found.start + found.length).max()) <= len(chunk)


def bag_chunks(data: bytes) -> None:
    found = bag_file.locate_bag(data)
    assert (found.start >= 0).all() and (found.length >= 0).all()
    assert not found.start.size or int((found.start + found.length).max()) <= len(data)


def _file(data: bytes, magic: bytes) -> Path:
    path = SCRATCH / "log"
    path.write_bytes(magic + data)
    return path


def mcap_walk(data: bytes) -> None:
    path = _file(data, mcap_file.MAGIC)
    reader = mcap_file.McapFile(path)
    assert all(chunk.data_at + chunk.data_size <= path.stat().st_size for chunk in reader.chunks)
    for batch in reader.batches():
        assert int((batch.start + batch.length).max(initial=0)) <= batch.data.shape[0]
    reader.close()


def bag_records(data: bytes) -> None:
    path = _file(data, bag_file.MAGIC)
    try:
        reader = bag_file.BagFile(path)
    except LogError:
        return
    for batch in reader.batches():
        assert int((batch.start + batch.length).max(initial=0)) <= batch.data.shape[0]
    reader.close()


def messages(encoding: str) -> Callable[[bytes], None]:
    """Messages of joint states by layout: whatever is taken lies within the message, and is like itself."""
    text = w.definition(w.JOINT_STATE, encoding).encode()
    channel = Channel(1, "/joint_states", w.JOINT_STATE, encoding, "ros1msg" if encoding == "ros1" else "ros2msg", text)
    kind = parse_schema(channel.type, channel.encoding, channel.schema_encoding, channel.schema, {})
    profile = profile_of(channel.type)

    def one(data: bytes) -> None:
        try:
            plan = column_extraction.make_plan(layout.walk(kind, data, cdr=encoding == "cdr"), profile)
        except layout.LayoutError:
            return
        rows = np.frombuffer(data, dtype=np.uint8)[None, :]
        assert plan.matches(rows) is None, "a message does not match its own layout"
        plan.columns_of(rows)

    return one


def seeds(target: str) -> list[bytes]:
    """Small valid inputs of a target."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        if target in ("cdr", "ros1"):
            said = w.motion(3, joints=2, encoding=target, with_wrench=False)
            return [w.encode(one, target, little=little) for one in said for little in (True, False)]
        kinds = ("mcap-zstd", "mcap-none", "mcap-unchunked") if target.startswith("mcap") else ("bag-none", "bag-lz4")
        out = []
        for kind in kinds:
            (place / kind).mkdir()
            path = w.write_any(place / kind, kind, lambda encoding: w.motion(4, joints=2, encoding=encoding))
            whole = path.read_bytes()
            if target.endswith("records"):
                out.append(whole[len(mcap_file.MAGIC if target.startswith("mcap") else bag_file.MAGIC) :])
            elif target == "mcap-chunk" and kind == "mcap-none":
                out += [b"\0" + whole[c.data_at : c.data_at + c.data_size] for c in mcap_file.McapFile(path).chunks]
            elif target == "bag-chunk" and kind == "bag-none":
                out += [whole[c.data_at : c.data_at + c.data_size] for c in bag_file.BagFile(path).chunks]
        return out


TARGETS: dict[str, Callable[[], Callable[[bytes], None]]] = {
    "mcap-chunk": lambda: mcap_chunks,
    "bag-chunk": lambda: bag_chunks,
    "mcap-records": lambda: mcap_walk,
    "bag-records": lambda: bag_records,
    "cdr": lambda: messages("cdr"),
    "ros1": lambda: messages("ros1"),
}


if __name__ == "__main__":
    target, corpus = sys.argv[1], Path(sys.argv[2])
    corpus.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(seeds(target)):
        (corpus / f"seed{number}").write_bytes(data)
    atheris.Setup([sys.argv[0], str(corpus), *sys.argv[3:]], TARGETS[target]())
    atheris.Fuzz()
