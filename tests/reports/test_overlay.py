"""One signal of two recordings on one plot: the same place is found, and where there is none that is said."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import samples
from browser import axe_source, launched, violations

from collaudit.core.data.audit_result import Audit
from collaudit.core.numeric.arrays import nearest_stretch
from collaudit.reports.page.matter_pages import overlay_page


def moving(period_s: float, late_s: float = 0.0, sha256: str = "", bend: float = 0.0) -> Audit:
    """An audit with contacts, whose joints repeat a motion, each in its own way; ``bend``: to other places."""
    made = samples.failed(20_000)
    turn = 2.0 * np.pi * (made.signals.time_s - late_s) / period_s
    columns = [np.sin(turn + k) + 0.3 * np.sin(2.0 * turn) + bend for k in range(made.signals.position_rad.shape[1])]
    log = replace(made.result.log, sha256=sha256 or made.result.log.sha256)
    return Audit(replace(made.result, log=log), replace(made.signals, position_rad=np.stack(columns, axis=1)))


def told(page: str) -> dict[float, float]:
    """By begin of what is shown of a contact, from when on the other is at the same place, s."""
    found = re.findall(r"<strong>.*?at ([\d.]+) s,.*?the other from ([-\d.]+) s on", page)
    return {float(onset) - 1.5: float(other) for onset, other in found}


def test_the_nearest_stretch_is_found_by_every_value() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        whole = np.cumsum(rng.standard_normal((400, 3)), axis=0)
        at = int(rng.integers(0, 340))
        short = whole[at : at + 60] + 0.01 * rng.standard_normal((60, 3))
        brute = [float(np.sqrt(np.sum((whole[k : k + 60] - short) ** 2) / 60)) for k in range(341)]
        found = nearest_stretch(short, whole)
        assert found is not None and found[0] == at == int(np.argmin(brute))
        assert found[1] == pytest.approx(brute[at], rel=1e-6)
        whole[at + 5] = np.nan
        holed = nearest_stretch(short, whole)
        assert holed is not None and not at - 54 <= holed[0] <= at + 5, "where values are missing nothing is alike"
    assert nearest_stretch(whole[:60], whole[:30]) is None


def test_the_same_place_in_another_run() -> None:
    first, other = moving(200.0), moving(200.0, late_s=4.2, sha256="other")
    page = overlay_page(first, other, "residual")
    found = told(page)
    assert len(found) == 2 and all(abs(other - start - 4.2) < 0.05 for start, other in found.items())
    assert page.count('class="model"') == 3, "and in the legend"
    assert "<script" not in page and len(page) < 200_000


def test_another_cycle_of_the_same_run() -> None:
    first = moving(11.0)
    found = told(overlay_page(first, first, "measured"))
    assert len(found) == 2, "never itself, but a whole number of cycles away"
    for start, other in found.items():
        assert abs(other - start) > 3.0 and abs((other - start + 5.5) % 11.0 - 5.5) < 0.05


def test_another_place_is_not_overlaid() -> None:
    page = overlay_page(moving(200.0), moving(200.0, sha256="other", bend=3.0), "velocity")
    assert "the other does not come to this place; the nearest is" in page and not told(page)
    body = page[page.index("<main") :]
    assert body.count('class="model"') == 1, "in the legend only"


def test_without_a_contact_the_whole_of_each_joint_is_shown() -> None:
    calm = moving(30.0)
    page = overlay_page(replace(calm, result=replace(calm.result, contacts=(), collisions=())), calm, "position")
    assert page.count("<figure>") == len(calm.signals.joint_names) and "from both starts" in page


def test_it_is_for_everybody(tmp_path: Path) -> None:
    from playwright.sync_api import sync_playwright

    (tmp_path / "o.html").write_text(overlay_page(moving(200.0), moving(200.0, 4.2, "other"), "residual"))
    axe = axe_source(tmp_path)
    with sync_playwright() as playwright:
        browser = launched(playwright)
        for width in (390, 1280, 1920):
            page: Any = browser.new_page(viewport={"width": width, "height": 900})
            page.goto((tmp_path / "o.html").as_uri())
            assert violations(page, axe) == []
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        browser.close()
