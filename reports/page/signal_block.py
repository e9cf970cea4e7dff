"""The data of the page's own plots as a block of JSON that no text can break out of."""

from __future__ import annotations

import json

import numpy as np
from markupsafe import Markup

from collaudit.reports.page.view import MOST_CONTACTS, AuditView
from collaudit.reports.plots.signal_data import pose_block


def signal_block(view: AuditView) -> Markup | None:
    """Curves of every joint of one audit, its contacts, and the arm; None where no joint has a residual."""
    joints = [{"id": f"{view.key}-joint-{k}"} | dict(f.data) for k, f in enumerate(view.figures, 1) if f.data]
    if not joints:
        return None
    block = {"end": view.end_s, "start": view.result.log.start, "joints": joints, "contacts": _contacts(view)}
    text = json.dumps(block | {"arm": _arm(view)}, allow_nan=False, separators=(",", ":"))
    for char in "<>&\u2028\u2029":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)


def _contacts(view: AuditView) -> list[list[object]]:
    """Of each contact its number, the time to show, its own, and which joints alarmed, by their place in the arm."""
    links = [] if view.result.arm is None else [link.joint for link in view.result.arm.links]
    listed = list(zip(view.result.contacts, view.contacts.windows, strict=True))[:MOST_CONTACTS]
    return [
        [
            number,
            *(round(s, 4) for s in (*window, contact.onset_s, contact.end_s)),
            [k for k, joint in enumerate(links) if joint in contact.joints],
        ]
        for number, (contact, window) in enumerate(listed, 1)
    ]


def _arm(view: AuditView) -> dict[str, object] | None:
    poses = {figure.joint: figure.pose for figure in view.figures if figure.pose is not None}
    if view.result.arm is None or any(link.joint and link.joint not in poses for link in view.result.arm.links):
        return None
    kept = next(iter(poses.values()))[0]
    position = np.stack([values for _, values in poses.values()], axis=1)
    return pose_block(view.result.arm, list(poses), position, kept)
