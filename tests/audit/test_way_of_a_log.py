"""One log goes through the rooms once, in the order of the picture: what a stage has done is not done again."""

from __future__ import annotations

import sys
from pathlib import Path
from types import FrameType

from user_guide.room_picture import ROOMS, room_of

from collaudit.core import api
from collaudit.core import audit as composition
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile

#: Rooms of types and of numbers: every stage makes its results of them.
SHARED = {"errors", "findings", "numeric", "data", "config", "audit", "provenance"}


def rooms_entered(log: Path, friction: FrictionFile) -> list[str]:
    """Rooms that ``api.audit`` and ``audit_log`` call into themselves, in order, each stay once."""
    stays: list[str] = []

    def watch(frame: FrameType, event: str, _argument: object) -> None:
        if event != "call" or frame.f_back is None:
            return
        room = room_of(str(frame.f_globals.get("__name__")))
        caller = frame.f_back.f_globals.get("__name__")
        own_code = frame.f_code.co_name.startswith("<") or frame.f_code.co_name == "__getattr__"  # no stages
        if room in SHARED or room is None or own_code or caller not in {composition.__name__, api.__name__}:
            return
        if room != "api" and stays[-1:] != [room]:
            stays.append(room)

    settings = load_config(log.with_suffix(".toml"))
    sys.setprofile(watch)
    try:
        api.audit(log, settings, friction)
    finally:
        sys.setprofile(None)
    return stays


def test_each_room_is_entered_once_and_in_order(hits: Path, friction: FrictionFile) -> None:
    stays = rooms_entered(hits, friction)
    assert stays[0] == "robot", "the description comes first: it names the joints that are read"
    assert stays.count("robot") == 2, "then the model, in the joints that the log has"
    rest = [room for room in stays if room != "robot"]
    assert rest.count("verdict") == 2, "what would have alarmed is measured, recommended with, and then decided on"
    rest.remove("verdict")
    assert rest == sorted(set(rest), key=ROOMS.index), rest
    assert {"logs", "prepare", "friction", "detection", "contacts", "scoring", "recommend", "verdict"} <= set(rest)
