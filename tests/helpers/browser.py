"""A real Chromium for report pages, axe-core for their accessibility, and a place for pictures of them."""

from __future__ import annotations

import base64
import os
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from npm_packages import unpack

_ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND"]


def absent(what: str) -> Any:
    """Skip, or fail where a browser is required."""
    if os.environ.get("COLLAUDIT_REQUIRE_BROWSER"):
        pytest.fail(f"{what} is required here and absent")
    pytest.skip(f"no {what} on this machine")


def launched(playwright: Any) -> Any:
    """Chromium by the path of the system's own, never one that is downloaded."""
    found = os.environ.get("COLLAUDIT_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        absent("Chromium")
    return playwright.chromium.launch(executable_path=found, args=_ARGUMENTS)


def axe_source(folder: Path) -> str:
    """axe-core from npm; where that is absent or offline, as the Python package carries it."""
    npm = shutil.which("npm")
    if npm is not None:
        packed = subprocess.run(
            [npm, "pack", "axe-core@4", "--silent"], cwd=folder, capture_output=True, text=True, timeout=120
        )
        if packed.returncode == 0:
            archive = folder / packed.stdout.strip().splitlines()[-1]
            unpack(archive, folder)
            return (folder / "package" / "axe.min.js").read_text(encoding="utf-8")
    spec = find_spec("axe_playwright_python")
    for place in [] if spec is None else spec.submodule_search_locations or []:
        return (Path(place) / "axe.min.js").read_text(encoding="utf-8")
    return absent("axe-core")


def violations(page: Any, axe: str, *rules: str) -> list[str]:
    """What axe-core finds on a page, of any impact; its script passes the page's own policy by the debugger.

    Args:
        page: that is open.
        axe: the script.
        rules: those to try; none: all.
    """
    if page.evaluate("typeof axe === 'undefined'"):  # half a megabyte: sent once to a page
        page.context.new_cdp_session(page).send("Runtime.evaluate", {"expression": f"(() => {{{axe}}})()"})
    options = {"resultTypes": ["violations"], **({"runOnly": [*rules]} if rules else {})}
    found = page.evaluate("(options) => axe.run(document, options).then((r) => r.violations)", options)
    return [f"{v['id']} ({v['impact']}): {node['html'][:200]}" for v in found for node in v["nodes"]]


def keep_picture(page: Any, name: str) -> None:
    """A screenshot of the whole page, where ``COLLAUDIT_SCREENSHOTS`` names a folder for them."""
    folder = os.environ.get("COLLAUDIT_SCREENSHOTS")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        width, height = page.evaluate("[innerWidth, document.documentElement.scrollHeight]")
        whole = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        # Chromium packs such a picture in half of the time, into a third more bytes.
        how = {"captureBeyondViewport": True, "optimizeForSpeed": True, "clip": whole}
        taken = page.context.new_cdp_session(page).send("Page.captureScreenshot", how)
        (Path(folder) / f"{name}.png").write_bytes(base64.b64decode(taken["data"]))
