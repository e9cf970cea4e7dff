"""A folder of batches, here or wherever fsspec leads: one Parquet file for each audit, added and never changed.

A batch appears whole under a name of its own: locally by a rename, elsewhere by the one request that makes an object.
Writers therefore never meet, and a reader sees a batch or not. Which record of a log counts, when it was judged more
than once, is decided on reading: the latest batch.
"""

from __future__ import annotations

import io
import json
import re
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from collaudit.core.errors import CollauditError, LogError
from collaudit.core.history.log_record import STORE_SCHEMA, LogRecord
from collaudit.core.small_files import check_regular
from collaudit.reports.files.atomic import atomic_write
from collaudit.reports.files.json_files import json_text, plain

_FOLDER = f"v{STORE_SCHEMA}"
_NAME = "store.json"
#: A batch of any version; one that is being written has a hidden name.
_BATCH = re.compile(r"v[0-9][^/]*/[^/]+/[^/.][^/]*\.parquet")
_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_SMALL = pa.float32()
JOINT = pa.struct(
    [
        ("joint", _TEXT),
        ("watched", pa.bool_()),
        ("gamma_nm", _NUMBER),
        ("n", _COUNT),
        *[(name, _NUMBER) for name in ("judged_s", "detectable_s", "observed_s", "clean_s")],
        *[(name, _NUMBER) for name in ("rms_nm", "p99_nm", "clean_mean_abs_nm", "gamma_margin", "temperature_c")],
        *[(name, _NUMBER) for name in ("friction_excess", "friction_excess_se", "load_excess", "load_excess_se")],
        *[(name, _NUMBER) for name in ("offset_nm", "offset_nm_se", "freedom")],
        *[(name, _NUMBER) for name in ("law_nm", "law_nm_low", "law_nm_high", "law_speed_rad_s")],
        ("friction_level", _NUMBER),
        ("peaks_nm", pa.list_(_SMALL)),
        ("peaks_minute", pa.list_(pa.int32())),
        ("peaks_count", _COUNT),
        ("minute_hours", pa.list_(_SMALL)),
    ]
)
PARAMETER = pa.struct(
    [
        *[(name, _TEXT) for name in ("joint", "model", "parameter")],
        *[(name, _NUMBER) for name in ("value", "ci95_low", "ci95_high")],
        ("identifiable", pa.bool_()),
    ]
)
CONTACT = pa.struct(
    [
        ("onset_s", _NUMBER),
        ("end_s", _NUMBER),
        ("joints", pa.list_(_TEXT)),
        ("link", _TEXT),
        ("kind", _TEXT),
        ("least_force_n", _NUMBER),
        ("peaks_nm", pa.list_(_NUMBER)),
        ("place_m", pa.list_(_NUMBER)),
        ("state", _TEXT),
    ]
)
NEAR_MISS = pa.struct(
    [
        ("joint", _TEXT),
        *[(name, _NUMBER) for name in ("onset_s", "duration_s", "peak_nm", "ratio")],
        ("kind", _TEXT),
    ]
)
FINDING = pa.struct([(name, _TEXT) for name in ("code", "severity", "joint", "text")])
SCHEMA = pa.schema(
    [
        *[(name, _TEXT) for name in ("robot", "night", "night_from", "log", "log_sha256", "start", "verdict")],
        ("reasons", pa.list_(_TEXT)),
        ("error", _TEXT),
        *[(name, _NUMBER) for name in ("duration_s", "period_s", "judged_h")],
        ("detector", _TEXT),
        ("persistence_s", _NUMBER),
        *[(name, _TEXT) for name in ("config_sha256", "friction_sha256", "model_sha256", "collaudit")],
        ("joints", pa.list_(JOINT)),
        ("friction", pa.list_(PARAMETER)),
        ("contacts", pa.list_(CONTACT)),
        ("near_misses", pa.list_(NEAR_MISS)),
        ("findings", pa.list_(FINDING)),
    ]
)
_HEAVY = ("peaks_nm", "peaks_minute", "minute_hours")
_LIGHT_JOINT = pa.struct([field for field in JOINT if field.name not in _HEAVY])
#: What trends need: all but the peaks of the residual, parameters and findings.
LIGHT_SCHEMA = pa.schema(
    [
        pa.field("joints", pa.list_(_LIGHT_JOINT)) if field.name == "joints" else field
        for field in SCHEMA
        if field.name not in ("friction", "findings")
    ]
)


@dataclass(frozen=True, slots=True)
class ResultStore:
    """A store by its folder or URL."""

    place: str

    @property
    def is_remote(self) -> bool:
        """Whether it is reached by fsspec."""
        return "://" in self.place

    def append(self, records: Sequence[LogRecord]) -> str | None:
        """Add records as one batch.

        Returns:
            Its name; None where there was nothing to add.

        Raises:
            CollauditError: the store cannot be written, or is of another version.
        """
        if not records:
            return None
        self.check()
        buffer = io.BytesIO()
        rows = [plain(record) for record in records]  # numbers that are not finite become null
        pq.write_table(pa.Table.from_pylist(rows, schema=SCHEMA), buffer, compression="zstd", compression_level=9)
        month = max(record.night for record in records)[:7]
        name = f"{_FOLDER}/{month}/{datetime.now(UTC):%Y%m%dT%H%M%S.%f}-{secrets.token_hex(6)}.parquet"
        self._write(name, buffer.getvalue())
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

    def table(self, light: bool = False) -> pa.Table:
        """All records, oldest batch first, with the batch and the row in it as further columns.

        Args:
            light: without what only thresholds and questions need.
        """
        schema = LIGHT_SCHEMA if light else SCHEMA
        parts = []
        for name in self.batches():
            try:
                file = pq.ParquetFile(io.BytesIO(self._read_if_there(name) or b""))
                part = file.read(column_paths(schema) if light else None)
            except (pa.ArrowInvalid, OSError) as error:
                raise LogError(
                    "a batch of the store cannot be read",
                    where=f"{self.place}/{name}",
                    found=str(error),
                    hint="move the file out of the store; the audit it came from can append again",
                ) from error
            part = part.select(schema.names).append_column("batch", pa.array([name] * part.num_rows, pa.string()))
            parts.append(part.append_column("batch_row", pa.array(range(part.num_rows), pa.int64())))
        empty = pa.schema([*schema, ("batch", pa.string()), ("batch_row", pa.int64())]).empty_table()
        return pa.concat_tables(parts) if parts else empty

    def records(self, evidence: bool = False) -> list[LogRecord]:
        """The record that counts of every log: the latest of each robot's log, in the order of robot and night.

        Args:
            evidence: with the peaks of the residual; without, they and the findings are not read.
        """
        rows = self.table(light=not evidence).to_pylist()
        latest = {record.identity: record for record in records_of(rows)}
        return sorted(latest.values(), key=lambda r: (r.robot, r.night, r.start or "", r.log, r.log_sha256 or ""))

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


def column_paths(schema: pa.Schema) -> list[str]:
    """Names of a schema's columns, as Parquet calls them: those inside joints one by one."""
    flat = [name for name in schema.names if name != "joints"]
    return flat + [f"joints.list.element.{field.name}" for field in schema.field("joints").type.value_type]


def records_of(rows: Iterable[Mapping[str, Any]]) -> list[LogRecord]:
    """Records of a table's rows.

    Raises:
        LogError: one is not what an audit writes.
    """
    try:
        return [msgspec.convert(row, LogRecord) for row in rows]
    except msgspec.ValidationError as error:
        raise LogError(
            "a record of the store cannot be read", found=str(error), expected="what collaudit audit --store writes"
        ) from error
