"""Servers of a folder of files: HTTP with and without ranges, and what reading needs of Azure's Blob service."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

_DATE = "Sun, 22 Nov 2026 00:00:00 GMT"
_XML = {"Content-Type": "application/xml"}


class FolderServer(ThreadingHTTPServer):
    """Serves a folder; ``sent`` counts bytes of files.

    With ``account`` it is a Blob service: the first folder of a path is the account's name, then a container's.
    """

    def __init__(self, folder: Path, *, ranges: bool = True, account: str = "") -> None:
        super().__init__(("127.0.0.1", 0), _Answers)
        self.folder, self.ranges, self.account, self.sent = folder, ranges, account, 0

    @property
    def url(self) -> str:
        """Of the folder."""
        return f"http://127.0.0.1:{self.server_address[1]}"


@contextmanager
def served(server: FolderServer) -> Iterator[FolderServer]:
    """Let a server answer, for as long as the block lasts."""
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Answers(BaseHTTPRequestHandler):
    server: FolderServer
    protocol_version = "HTTP/1.1"

    def log_message(self, *_: object) -> None:
        """Say nothing."""

    def do_HEAD(self) -> None:
        """Facts of a file."""
        self._answer(body=False)

    def do_GET(self) -> None:
        """A file, a part of it, or what is in a folder."""
        self._answer(body=True)

    def _answer(self, body: bool) -> None:
        parts = urlsplit(self.path)
        query = parse_qs(parts.query)
        name = unquote(parts.path).lstrip("/").removeprefix(self.server.account).lstrip("/")
        path = self.server.folder / name
        if query.get("comp") == ["list"]:
            return self._say(200, self._listing(path, query.get("prefix", [""])[0]), _XML, body)
        if path.is_dir() and not self.server.account:
            names = "".join(f'<a href="{one.name}">{one.name}</a>' for one in sorted(path.iterdir()))
            return self._say(200, names.encode(), {"Content-Type": "text/html"}, body)
        if not path.is_file():
            return self._say(404, b"", {"x-ms-error-code": "BlobNotFound"}, body)
        return self._file(path, body)

    def _file(self, path: Path, body: bool) -> None:
        data, stamp = path.read_bytes(), path.stat().st_mtime_ns
        facts = {"ETag": f'"{stamp}"', "Last-Modified": _DATE, "x-ms-blob-type": "BlockBlob"}
        facts |= {"Accept-Ranges": "bytes"} if self.server.ranges else {}
        asked = re.match(r"bytes=(\d+)-(\d*)", self.headers.get("x-ms-range") or self.headers.get("Range") or "")
        if asked is None or not self.server.ranges:
            return self._say(200, data, facts, body, count=True)
        first, last = int(asked[1]), min(int(asked[2] or len(data) - 1), len(data) - 1)
        facts["Content-Range"] = f"bytes {first}-{last}/{len(data)}"
        return self._say(206, data[first : last + 1], facts, body, count=True)

    def _listing(self, container: Path, prefix: str) -> bytes:
        found = [one for one in sorted(container.rglob("*")) if one.is_file()]
        names = [(one.relative_to(container).as_posix(), one.stat().st_size) for one in found]
        blobs = "".join(
            f"<Blob><Name>{escape(name)}</Name><Deleted>false</Deleted><Properties>"
            f"<Last-Modified>{_DATE}</Last-Modified><Etag>1</Etag><Content-Length>{size}</Content-Length>"
            "<BlobType>BlockBlob</BlobType></Properties><Metadata/></Blob>"
            for name, size in names
            if name.startswith(prefix)
        )
        head = '<?xml version="1.0" encoding="utf-8"?><EnumerationResults ServiceEndpoint="" ContainerName="logs">'
        return f"{head}<Blobs>{blobs}</Blobs><NextMarker/></EnumerationResults>".encode()

    def _say(self, code: int, data: bytes, facts: dict[str, str], body: bool, count: bool = False) -> None:
        self.send_response(code)
        for name, value in {"Content-Length": str(len(data)), **facts}.items():
            self.send_header(name, value)
        self.end_headers()
        for at in range(0, len(data) if body else 0, 1 << 16):  # who asked may leave before the end
            self.wfile.write(data[at : at + (1 << 16)])
            self.server.sent += len(data[at : at + (1 << 16)]) if count else 0
