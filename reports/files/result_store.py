"""A folder of batches, here or wherever fsspec leads: one Parquet file for each audit, which only pruning changes.

A batch appears whole under a name of its own: locally by a rename, elsewhere by the one request that makes an object.
Writers therefore never meet, and a reader sees a batch or not. Which rows of a log count, when it was judged more than
once, is decided on reading: the latest batch.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import secrets
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from collaudit.core.data.signals import CycleReference
from collaudit.core.errors import CollauditError, LogError
from collaudit.core.history.night_row import STORE_SCHEMA, NightRow
from collaudit.core.small_files import check_regular
from collaudit.reports.files.run_files import read_reference
from collaudit.reports.files.written_files import atomic_write, json_text, plain

_FOLDER = f"v{STORE_SCHEMA}"
_NAME = "store.json"
#: A batch of any version; one that is being written has a hidden name.
_BATCH = re.compile(r"v[0-9][^/]*/[^/]+/[^/.][^/]*\.parquet")
_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_CONTACT = pa.struct(
    [
        ("number", _COUNT),
        ("onset_s", _NUMBER),
        ("peak_nm", _NUMBER),
        ("place_m", pa.list_(_NUMBER)),
        ("state", _TEXT),
    ]
)
SCHEMA = pa.schema(
    [
        *[(name, _TEXT) for name in ("robot", "night", "night_from", "log", "log_sha256", "start", "verdict", "why")],
        ("joint", _TEXT),
        ("tested", pa.bool_()),
        *[(name, _NUMBER) for name in ("judged_s", "level_nm", "gamma_nm", "friction_nm")],
        ("near_misses", _COUNT),
        ("contacts", pa.list_(_CONTACT)),
        *[(name, _TEXT) for name in ("config_sha256", "friction_sha256", "collaudit")],
    ]
)


#: Nights of a program whose cycles are kept: enough for a median, some ten kB each.
_NIGHTS_KEPT = 20


def _of_program(robot: str, program: str) -> str:
    key = "\n".join((robot, program)).encode("utf-8", "surrogateescape")
    return f"{_FOLDER}/cycles/{hashlib.sha256(key).hexdigest()[:16]}"


@dataclass(frozen=True, slots=True)
class ResultStore:
    """A store by its folder or URL."""

    place: str

    @property
    def is_remote(self) -> bool:
        """Whether it is reached by fsspec."""
        return "://" in self.place

    def append(self, rows: Sequence[NightRow]) -> str | None:
        """Add rows as one batch.

        Returns:
            Its name; None where there was nothing to add.

        Raises:
            CollauditError: the store cannot be written, or is of another version.
        """
        if not rows:
            return None
        self.check()
        values = [plain(row) for row in rows]  # numbers that are not finite become null
        month = max(row.night for row in rows)[:7]
        name = f"{_FOLDER}/{month}/{datetime.now(UTC):%Y%m%dT%H%M%S.%f}-{secrets.token_hex(6)}.parquet"
        self._write_rows(name, pa.Table.from_pylist(values, schema=SCHEMA))
        return name

    def batches(self) -> list[str]:
        """Names of all batches, oldest first by the time they were added.

        Raises:
            CollauditError: it is no store, or of a later version.
        """
        self.check(must_exist=True)
        names = sorted(filter(_BATCH.fullmatch, self._files()), key=lambda name: name.rpartition("/")[2])
        for name in names:
            self._refuse_other(name.partition("/")[0].removeprefix("v"))
        return names

    def table(self) -> pa.Table:
        """All rows, oldest batch first, with the batch as a further column."""
        parts = []
        for name in self.batches():
            try:
                part = pq.ParquetFile(io.BytesIO(self._read_if_there(name) or b"")).read().select(SCHEMA.names)
            except (pa.ArrowInvalid, OSError, KeyError) as error:
                raise LogError(
                    "a batch of the store cannot be read",
                    where=f"{self.place}/{name}",
                    found=str(error),
                    hint="move the file out of the store; the audit it came from can append again",
                ) from error
            parts.append(part.append_column("batch", pa.array([name] * part.num_rows, pa.string())))
        return pa.concat_tables(parts) if parts else pa.schema([*SCHEMA, ("batch", pa.string())]).empty_table()

    def by_batch(self) -> dict[tuple[str, tuple[str, str]], list[NightRow]]:
        """The rows of each log in each batch, by name of the batch and identity of the log, oldest batch first."""
        found: dict[tuple[str, tuple[str, str]], list[NightRow]] = {}
        for value in self.table().to_pylist():
            row = _row_of(value)
            found.setdefault((value["batch"], row.identity), []).append(row)
        return found

    def without(self, batch: str, identities: Collection[tuple[str, str]]) -> None:
        """Take logs out of a batch, which is replaced as a whole.

        Args:
            batch: its name.
            identities: of the logs.

        Raises:
            CollauditError: the store cannot be read or written.
        """
        part = pq.ParquetFile(io.BytesIO(self._read_if_there(batch) or b"")).read()
        stays = [_row_of(value).identity not in identities for value in part.select(SCHEMA.names).to_pylist()]
        self._write_rows(batch, part.filter(pa.array(stays, pa.bool_())))

    def keep_reference(self, robot: str, program: str, night: str, log_sha256: str, content: bytes) -> None:
        """Keep what a passed night says of a program's cycles; only the latest nights stay.

        Args:
            robot, program: whose it is.
            night: ISO date.
            log_sha256: of its log; the same log replaces what was kept of it.
            content: of :func:`collaudit.reports.files.run_files.reference_bytes`.

        Raises:
            CollauditError: the store cannot be written.
        """
        folder = _of_program(robot, program)
        self._write(f"{folder}/{night}-{log_sha256[:16]}.npz", content)
        for name in self._references(folder)[:-_NIGHTS_KEPT]:
            if self.is_remote:
                fs, root = self._remote()
                fs.rm_file(f"{root}/{name}")
            else:
                (Path(self.place) / name).unlink(missing_ok=True)

    def references(self, robot: str, program: str) -> tuple[CycleReference, ...]:
        """What passed nights say of a program's cycles, in their order.

        Raises:
            CollauditError: the store, or a file of it, cannot be read.
        """
        names = self._references(_of_program(robot, program))
        contents = ((name.rpartition("/")[2], self._read_if_there(name)) for name in names)
        return tuple(read_reference(x, name[:10], name[11:-4]) for name, x in contents if x is not None)

    def _references(self, folder: str) -> list[str]:
        return sorted(name for name in self._files() if name.startswith(f"{folder}/") and name.endswith(".npz"))

    def rows(self) -> list[NightRow]:
        """The rows that count: those of the latest batch with the log, in the order of robot, night and log."""
        latest = {rows[0].identity: rows for rows in self.by_batch().values()}
        every = [row for rows in latest.values() for row in rows]
        return sorted(every, key=lambda r: (r.robot, r.night, r.start or "", r.log, r.log_sha256 or ""))

    def check(self, must_exist: bool = False) -> None:
        """Make a new store, or see that this is one that can be read.

        Raises:
            CollauditError: it is not.
        """
        content = self._read_if_there(_NAME)
        if content is None and not must_exist and not self._others():
            note = "Results of collaudit audit --store. Append only."
            self._write(_NAME, json_text({"schema": f"collaudit/store/{STORE_SCHEMA}", "note": note}).encode())
            return
        try:
            schema = str(json.loads(content or b"{}").get("schema", ""))
        except (ValueError, AttributeError, RecursionError):
            schema = ""
        number = schema.removeprefix("collaudit/store/")
        if schema == number or not number.isdigit():
            raise CollauditError(
                "this is no store of results",
                where=self.place,
                expected=f"a folder or URL that collaudit audit --store made, with {_NAME}",
                hint=None if must_exist else "name a new or empty folder",
            )
        self._refuse_other(number)

    def _refuse_other(self, number: str) -> None:
        if number != str(STORE_SCHEMA):
            raise CollauditError(
                "this store, or a batch in it, was written by another version of collaudit",
                where=self.place,
                found=f"schema {number}",
                expected=f"schema {STORE_SCHEMA}",
                hint="name a new folder, or use the version that wrote it",
            )

    def _write_rows(self, name: str, rows: pa.Table) -> None:
        buffer = io.BytesIO()
        pq.write_table(rows, buffer, compression="zstd", compression_level=9)
        self._write(name, buffer.getvalue())

    def _write(self, name: str, content: bytes) -> None:
        if not self.is_remote:
            atomic_write(Path(self.place) / name, content)
            return
        fs, root = self._remote()
        try:
            fs.makedirs(f"{root}/{name}".rpartition("/")[0], exist_ok=True)
            fs.pipe_file(f"{root}/{name}", content)
        except Exception as error:
            raise CollauditError("the store cannot be written", where=self.place, found=str(error)) from error

    def _read_if_there(self, name: str) -> bytes | None:
        if not self.is_remote:
            try:
                check_regular(Path(self.place) / name)
                return (Path(self.place) / name).read_bytes()
            except (FileNotFoundError, NotADirectoryError):
                return None
            except OSError as error:
                raise CollauditError(
                    "the store cannot be read", where=self.place, found=error.strerror or str(error)
                ) from error
        fs, root = self._remote()
        try:
            return bytes(fs.cat_file(f"{root}/{name}"))
        except FileNotFoundError:
            return None
        except Exception as error:
            raise CollauditError("the store cannot be read", where=self.place, found=str(error)) from error

    def _files(self) -> Iterator[str]:
        """Names of the files in it, as they are found."""
        if not self.is_remote:
            root = Path(self.place)
            return (path.relative_to(root).as_posix() for path in root.rglob("*") if not path.is_dir())
        fs, root_name = self._remote()
        return (str(name)[len(root_name) :].lstrip("/") for name in fs.find(root_name))

    def _others(self) -> bool:
        """Whether something lies there that is not of a store, such as another writer may be making at this moment."""
        names = (name for name in self._files() if not name.startswith((f".{_NAME}.", f"{_FOLDER}/")))
        return any(name != _NAME for name in names) or (not self.is_remote and Path(self.place).is_file())

    def _remote(self) -> tuple[Any, str]:
        try:
            import fsspec
        except ModuleNotFoundError as error:
            raise CollauditError(
                "stores at a URL need fsspec", where=self.place, hint="python -m pip install 'collaudit[fleet]'"
            ) from error
        try:
            fs, root = fsspec.core.url_to_fs(self.place)
        except (ImportError, ValueError) as error:
            raise CollauditError(
                "there is no way to this URL", where=self.place, found=str(error), hint="install what the message names"
            ) from error
        return fs, str(root).rstrip("/")


def _row_of(value: Mapping[str, Any]) -> NightRow:
    try:
        return msgspec.convert(value, NightRow)
    except msgspec.ValidationError as error:
        raise LogError(
            "a row of the store cannot be read", found=str(error), expected="what collaudit audit --store writes"
        ) from error
