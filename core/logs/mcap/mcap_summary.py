"""The summary section of an MCAP file: what is in a huge file, without walking over it."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import numpy as np

from collaudit.core.logs.mcap.mcap_file import McapFile
from collaudit.core.logs.mcap.mcap_records import McapIndex, read_summary
from collaudit.core.logs.signals.impossible_values import plausible_ns
from collaudit.core.logs.storage.chunked_file import ChunkRef
from collaudit.core.logs.storage.file_reading import RandomFile
from collaudit.core.logs.storage.records import Overview


def overview_of(path: Path) -> Overview | None:
    """Counts and times as a file's summary states them, and a reader of one chunk of each channel.

    Args:
        path: an MCAP file.

    Returns:
        None when the file has no usable summary, or schemas that stand in none of these chunks.
    """
    with closing(RandomFile(path)) as file:
        index = read_summary(file)
    if index is None:
        return None
    text = (
        f"Only the summary and the first chunk of each topic were read, of {len(index.chunks)} chunks: rates are means "
        "over the whole log; gaps, clocks and damage inside the chunks were not looked for."
    )
    reader = McapFile(path, _first_chunks(index))
    if reader.index.lacks_schemas():
        reader.close()
        return None
    stamps = np.array(index.stamps_ns, dtype=np.uint64).astype(np.int64)
    good, garbage = plausible_ns(stamps, path.name)
    if garbage:
        text += " Times that are none of this recording stand in the summary; the length leaves them out."
    return Overview(reader, index.counts, (int(good.min()), int(good.max())), text)


def _first_chunks(index: McapIndex) -> McapIndex:
    """An index of the first chunk that holds each channel, and no others."""
    chosen: dict[int, ChunkRef] = {}
    left = set(index.channels)
    for chunk in index.chunks:
        held = {number for number, _, _ in chunk.index}
        if held & left or not held:
            chosen[chunk.at] = chunk
            left -= held
        if not left or len(chosen) > 16:
            break
    return McapIndex(index.schemas, index.channels, list(chosen.values()))
