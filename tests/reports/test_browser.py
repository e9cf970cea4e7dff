"""The page in a real browser: it renders offline, says its verdict, and runs nothing."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import samples
from matplotlib.image import imread

from collaudit.core.data.audit_result import Audit
from collaudit.core.errors import LogError
from collaudit.reports.page.html import write_html
from collaudit.reports.page.index import entry_of, entry_of_error, write_index

pytestmark = pytest.mark.browser

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-default-apps",
    "--disable-extensions",
    "--hide-scrollbars",
    "--window-size=1200,1600",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)
RED, GREEN, BROWN = (0xB0, 0x00, 0x20), (0x14, 0x62, 0x3A), (0x6B, 0x44, 0x00)


@pytest.fixture(scope="module")
def chromium() -> str:
    found = os.environ.get("COLLAUDIT_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        if os.environ.get("COLLAUDIT_REQUIRE_BROWSER"):
            pytest.fail("a Chromium is required here and absent")
        pytest.skip("no Chromium on this machine (set COLLAUDIT_CHROMIUM to one)")
    return found


class Visit:
    """One page load: its DOM afterwards, console messages, addresses asked for, and a picture."""

    def __init__(self, chromium: str, page: Path, folder: Path) -> None:
        net_log, picture = folder / "net.json", folder / "page.png"
        self.dom = self._run(chromium, folder, "--dump-dom", f"--log-net-log={net_log}", page.as_uri())[0]
        errors = self._run(chromium, folder, f"--screenshot={picture}", "--enable-logging=stderr", page.as_uri())[1]
        self.console = [line for line in errors.splitlines() if "CONSOLE" in line]
        self.addresses = addresses(net_log)
        self.picture = np.rint(255 * imread(picture)[:, :, :3]).astype(int)

    def _run(self, chromium: str, folder: Path, *arguments: str) -> tuple[str, str]:
        profile = f"--user-data-dir={folder / 'profile'}"
        done = subprocess.run(
            [chromium, *FLAGS, profile, *arguments], capture_output=True, text=True, timeout=120, check=True
        )
        return done.stdout, done.stderr

    def pixels(self, colour: tuple[int, int, int]) -> int:
        """Pixels of about this colour."""
        return int((np.abs(self.picture - colour).max(axis=2) <= 6).sum())


def addresses(net_log: Path) -> set[str]:
    """Addresses the page asked for; what the browser asks for on its own has no origin."""
    events = [event.get("params", {}) for event in json.loads(net_log.read_text())["events"]]
    return {event["url"] for event in events if event.get("initiator", "not an origin") != "not an origin"}


def visit(chromium: str, tmp_path: Path, audits: list[Audit]) -> Visit:
    write_html(tmp_path / "report.html", audits)
    return Visit(chromium, tmp_path / "report.html", tmp_path)


@pytest.mark.parametrize(
    ("make", "word", "colour"),
    [(samples.failed, "FAIL", RED), (samples.passed, "PASS", GREEN), (samples.not_judged, "NOT JUDGED", BROWN)],
)
def test_the_verdict_is_seen_and_nothing_is_fetched(chromium: str, tmp_path: Path, make, word: str, colour) -> None:
    seen = visit(chromium, tmp_path, [make(5000)])
    assert f"<title>{word}: collision audit of" in seen.dom
    assert seen.console == []
    assert {address for address in seen.addresses if not address.startswith("file:")} == set()
    others = {RED, GREEN, BROWN} - {colour}
    assert seen.pixels(colour) > 3000
    assert all(seen.pixels(colour) > 3 * seen.pixels(other) for other in others)


def test_hostile_names_run_nothing(chromium: str, tmp_path: Path) -> None:
    seen = visit(chromium, tmp_path, [samples.hostile()])
    assert "<title>FAIL: collision audit of &lt;script&gt;" in seen.dom
    assert seen.console == []
    assert {address for address in seen.addresses if not address.startswith("file:")} == set()


def test_the_test_would_notice(chromium: str, tmp_path: Path) -> None:
    page = tmp_path / "bad.html"
    page.write_text(
        "<title>a</title><script>document.title='owned';console.error('bad')</script><img src='http://x.invalid/'>"
    )
    seen = Visit(chromium, page, tmp_path)
    assert "<title>owned</title>" in seen.dom
    assert len(seen.console) >= 1
    assert "http://x.invalid/" in seen.addresses


def test_the_index_opens(chromium: str, tmp_path: Path) -> None:
    entries = [entry_of(samples.hostile().result, "a/report.html"), entry_of_error("b.bag", LogError("cut short"))]
    write_index(tmp_path, entries)
    seen = Visit(chromium, tmp_path / "index.html", tmp_path)
    assert "<title>FAIL: collision audit of 2 logs</title>" in seen.dom
    assert seen.console == []
    assert seen.pixels(RED) > 3000
