"""Several files of one recording read as one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from collaudit.core.logs.storage.records import Batch, Channel, Damage, MessageReader, Progress


class JoinedRecording:
    """Several files of one recording read as one log, in the order given."""

    def __init__(self, readers: Sequence[tuple[Path, MessageReader]], damage: Sequence[Damage]) -> None:
        self._readers = tuple(readers)
        self._folder_damage = tuple(damage)
        self.format = self._readers[0][1].format
        self.channels, self._keys = _joined([reader.channels for _, reader in self._readers])

    @property
    def damage(self) -> list[Damage]:
        """The damage of the folder and of all files, the latter with their names."""
        files = [(path.name, item) for path, reader in self._readers for item in reader.damage]
        return [*self._folder_damage, *(Damage(f"{name}: {item.text}", item.lost) for name, item in files)]

    def batches(self, keys: frozenset[int] | None = None, progress: Progress | None = None) -> Iterator[Batch]:
        """Raw messages, file after file."""
        total = sum(path.stat().st_size for path, _ in self._readers)
        done = 0
        for (path, reader), names in zip(self._readers, self._keys, strict=True):
            wanted = frozenset(inner for inner, key in names.items() if keys is None or key in keys)
            inner = _shifted(progress, done, total)
            for batch in reader.batches(wanted, inner) if wanted else ():
                yield replace(batch, key=names[batch.key])
            done += path.stat().st_size

    def close(self) -> None:
        """Release the files."""
        for _, reader in self._readers:
            reader.close()


def _joined(files: Sequence[Sequence[Channel]]) -> tuple[tuple[Channel, ...], tuple[dict[int, int], ...]]:
    """The channels of all files, and for each file its keys to theirs.

    A channel that goes on in the next file, told by topic and definition, stays one: its clock can be followed. Several
    of the same kind on one topic are told by their order.
    """
    out: dict[tuple[Channel, int], Channel] = {}
    keys = []
    for channels in files:
        counts: Counter[Channel] = Counter()
        names = {}
        for channel in channels:
            kind = replace(channel, key=0, claimed=0)
            joined = out.setdefault((kind, counts[kind]), replace(channel, key=len(out)))
            counts[kind] += 1
            names[channel.key] = joined.key
        keys.append(names)
    return tuple(out.values()), tuple(keys)


def _shifted(progress: Progress | None, base: int, total: int) -> Progress | None:
    if progress is None:
        return None
    return lambda done, _: progress(base + done, total)
