"""The layout compiler against rosbags and the mcap packages, on schemas and messages made by Hypothesis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType, SimpleNamespace
from typing import Any

import log_writers as w
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.interfaces import Nodetype
from rosbags.serde import cdr, ros1
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from collaudit.core.logs.messages.column_extraction import GroupKey
from collaudit.core.logs.messages.layout import Layout, LayoutError, Numbers, lay_out, walk
from collaudit.core.logs.messages.message_decoding import ChannelDecoder, Decoded
from collaudit.core.logs.messages.message_schema import parse_schema
from collaudit.core.logs.storage.readers import Batch, Channel
from collaudit.core.vendors.message_profiles import PROFILES, Profile

NUMBERS = {
    "bool": "?", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
BASES = (*NUMBERS, "string")
FIELD = st.tuples(st.sampled_from(BASES), st.sampled_from(["", "", "[]", "[3]", "[0]", "[<=4]"]))
LENIENT = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@pytest.fixture(scope="module", autouse=True)
def _compiled_once() -> Iterator[None]:
    """rosbags writes twelve functions a type and compiles them: half of the time here, unless equal ones are shared."""
    compiled: Callable[[str], CodeType] = lru_cache(2000)(lambda text: compile(text, "rosbags", "exec"))

    def compile_lines(lines: list[str]) -> Any:
        names: dict[str, Any] = {}
        exec(compiled("\n".join(lines)), names)
        return SimpleNamespace(**names)

    with pytest.MonkeyPatch.context() as patch:
        for module in (cdr, ros1):
            patch.setattr(module, "compile_lines", compile_lines)
        yield


@dataclass(frozen=True)
class Made:
    """A type store with one made-up type, and its definition."""

    store: Any
    text: str
    name: str = "made/msg/Outer"


@st.composite
def made_types(draw: st.DrawFn) -> Made:
    """Up to two nested message types with random fields."""
    inner = draw(st.lists(FIELD, min_size=1, max_size=4))
    outer = draw(st.lists(st.one_of(FIELD, st.tuples(st.just("made/Inner"), FIELD.map(lambda f: f[1]))), max_size=7))
    lines = [_line(kind, form, i) for i, (kind, form) in enumerate(outer)] or ["uint8 a"]
    lines += ["=" * 80, "MSG: made/Inner", *(_line(kind, form, i) for i, (kind, form) in enumerate(inner))]
    text = "\n".join(lines) + "\n"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, "made/msg/Outer"))
    return Made(store, text)


def _line(kind: str, form: str, index: int) -> str:
    ros1_safe = form.replace("<=4", "") if form == "[<=4]" else form
    return f"{kind}{'' if form == '[0]' else ros1_safe} f{index}"


def value_of(draw: st.DrawFn, store: Any, desc: Any) -> Any:
    kind, what = desc
    if kind == Nodetype.BASE:
        return scalar(draw, what[0])
    if kind == Nodetype.NAME:
        return message_of(draw, store, what)
    item, size = what
    count = size if kind == Nodetype.ARRAY else draw(st.integers(0, 4))
    values = [value_of(draw, store, item) for _ in range(count)]
    if item[0] == Nodetype.BASE and item[1][0] != "string":
        return np.array(values, dtype=np.dtype(NUMBERS[item[1][0]]))
    return values


def scalar(draw: st.DrawFn, name: str) -> Any:
    if name == "string":
        return draw(st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9))
    if name == "bool":
        return draw(st.booleans())
    code = NUMBERS[name]
    if code[0] == "f":
        return np.frombuffer(draw(st.binary(min_size=int(code[1]), max_size=int(code[1]))), code)[0].item()
    low, high = np.iinfo(code).min, np.iinfo(code).max
    return draw(st.integers(int(low), int(high)))


def message_of(draw: st.DrawFn, store: Any, name: str) -> Any:
    fields = store.fielddefs[name][1]
    return store.types[name](**{key: value_of(draw, store, desc) for key, desc in fields})


def flatten(value: Any, path: tuple[Any, ...] = ()) -> dict[tuple[Any, ...], Any]:
    """Path to number, array or string of a message, in the form a layout names its fields."""
    if hasattr(value, "__msgtype__"):
        names = [name for name in value.__dataclass_fields__ if name != "__msgtype__"]
        return {k: v for name in names for k, v in flatten(getattr(value, name), (*path, name)).items()}
    if isinstance(value, list):
        return {k: v for i, item in enumerate(value) for k, v in flatten(item, (*path, i)).items()}
    return {path: value}


def leaves(node: Any, path: tuple[Any, ...] = ()) -> dict[tuple[Any, ...], Any]:
    """Path to numbers and strings of a layout."""
    if not isinstance(node, dict | list):
        return {path: node}
    pairs = node.items() if isinstance(node, dict) else enumerate(node)
    return {k: v for name, item in pairs for k, v in leaves(item, (*path, name)).items()}


def read_all(layout: Any, data: bytes) -> dict[tuple[Any, ...], Any]:
    """Every field of a message as the layout places it."""
    out: dict[tuple[Any, ...], Any] = {}
    for path, part in leaves(layout.root).items():
        if isinstance(part, Numbers):
            out[path] = np.frombuffer(data, dtype=part.code, count=part.count, offset=part.offset)
        else:
            out[path] = data[part.offset : part.offset + part.size].decode()
    return out


def same(found: Any, expected: Any) -> bool:
    if isinstance(expected, str):
        return bool(found == expected)
    wanted = np.atleast_1d(np.asarray(expected))
    return bool(found.astype(wanted.dtype).tobytes() == np.ascontiguousarray(wanted).tobytes())


@pytest.mark.parametrize("wire", ["cdr-le", "cdr-be", "ros1"])
@given(data=st.data())
@LENIENT
def test_every_field_is_where_rosbags_finds_it(wire: str, data: st.DataObject) -> None:
    made = data.draw(made_types())
    value = message_of(data.draw, made.store, made.name)
    encoding = wire.split("-")[0]
    raw = w.encode(w.Said("/x", made.name, 0, value), encoding, little=wire != "cdr-be", store=made.store)
    read = made.store.deserialize_cdr if encoding == "cdr" else made.store.deserialize_ros1
    expected = flatten(read(raw, made.name))
    schema_encoding = "ros2msg" if encoding == "cdr" else "ros1msg"
    kind = parse_schema(made.name, encoding, schema_encoding, made.text.encode())
    found = read_all(walk(kind, raw, cdr=encoding == "cdr"), raw)
    assert set(found) == set(expected)
    for path, want in expected.items():
        assert same(found[path], want), path


@given(data=st.data())
@LENIENT
def test_cut_and_flipped_messages_are_refused_or_read_within_bounds(data: st.DataObject) -> None:
    made = data.draw(made_types())
    raw = bytearray(
        w.encode(w.Said("/x", made.name, 0, message_of(data.draw, made.store, made.name)), "cdr", store=made.store)
    )
    for _ in range(data.draw(st.integers(0, 3))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    raw = raw[: data.draw(st.integers(0, len(raw)))]
    kind = parse_schema(made.name, "cdr", "ros2msg", made.text.encode())
    try:
        layout = walk(kind, bytes(raw), cdr=True)
    except LayoutError:
        return
    for part in leaves(layout.root).values():
        assert (part.stop if isinstance(part, Numbers) else part.offset + part.size) <= len(raw)


JOINT_TEXT = """{before}
std_msgs/Header header
{between}
string[] name
float{bits}[] position
{after}
float64[] velocity
float64[] effort
{last}
"""
HEADER1 = "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
HEADER2 = (
    "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80
    + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)


@st.composite
def joint_types(draw: st.DrawFn, encoding: str) -> Made:
    """A message with the fields of a JointState among others."""
    extra = [draw(st.lists(FIELD, max_size=2)) for _ in range(4)]
    parts = [
        "\n".join(_line(kind, form, 10 * block + i) for i, (kind, form) in enumerate(fields))
        for block, fields in enumerate(extra)
    ]
    bits = draw(st.sampled_from([32, 64]))
    text = JOINT_TEXT.format(before=parts[0], between=parts[1], after=parts[2], last=parts[3], bits=bits)
    text += "=" * 80 + "\n" + (HEADER1 if encoding == "ros1" else HEADER2)
    store = get_typestore(Stores.EMPTY)
    types = dict(get_types_from_msg(text, "made/msg/Joints"))
    for name in ("Time", "Duration"):
        full = f"builtin_interfaces/msg/{name}"
        types.setdefault(full, w.ROS1.fielddefs[full])
    store.register(types)
    return Made(store, text, "made/msg/Joints")


JOINTS = next(profile for profile in PROFILES if profile.name == "joint-state")


@st.composite
def joint_messages(draw: st.DrawFn, made: Made) -> list[Any]:
    """Messages that repeat a few layouts, with joints in changing order and arrays at times empty."""
    names = ["a", "bb", "gelenk_ü", "d"]
    shape = st.tuples(st.permutations(names), st.integers(0, 4), st.booleans(), st.booleans())
    shapes = draw(st.lists(shape, min_size=1, max_size=3))
    picks = draw(st.lists(st.integers(0, len(shapes) - 1), min_size=1, max_size=12))
    base = message_of(draw, made.store, made.name)
    out = []
    for number, pick in enumerate(picks):
        order, count, velocity, effort = shapes[pick]
        fields = {name: getattr(base, name) for name in base.__dataclass_fields__ if name != "__msgtype__"}
        fields["name"] = list(order[:count])
        bits = np.float32 if np.asarray(base.position).dtype == np.float32 else np.float64
        fields["position"] = (np.arange(count) + 0.1 * number).astype(bits)
        fields["velocity"] = np.arange(count) * 0.2 if velocity else np.empty(0)
        fields["effort"] = np.arange(count) - 0.3 * number if effort else np.empty(0)
        if draw(st.booleans()):
            header = made.store.types["std_msgs/msg/Header"]
            old = base.header
            kept = {name: getattr(old, name) for name in old.__dataclass_fields__ if name != "__msgtype__"}
            fields["header"] = header(**{**kept, "frame_id": "f" * draw(st.integers(0, 5))})
        out.append(type(base)(**fields))
    return out


def plain(value: Any) -> Any:
    """A message of rosbags as mappings and lists."""
    if hasattr(value, "__msgtype__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__ if name != "__msgtype__"}
    return (
        [plain(item) for item in value]
        if isinstance(value, list | np.ndarray)
        else getattr(value, "item", lambda: value)()
    )


def decode(
    channel: Channel, profile: Profile, payloads: list[bytes], lay: Callable[[bytes], Layout] | None = None
) -> Decoded:
    out = Decoded()
    decoder = ChannelDecoder(channel, profile, out)
    if lay is not None:
        decoder.lay, decoder.max_plans = lay, 0
    length = np.array([len(p) for p in payloads], dtype=np.int64)
    data = np.frombuffer(b"".join(payloads), dtype=np.uint8)
    stop = np.cumsum(length)
    half = len(payloads) // 2
    for part in (slice(0, half), slice(half, None)):
        if length[part].size:
            decoder.add(Batch(1, data, (stop - length)[part], length[part], np.arange(len(payloads))[part]))
    return out


@pytest.mark.parametrize("wire", ["cdr-le", "cdr-be", "ros1"])
@given(data=st.data())
@LENIENT
def test_columns_equal_the_values_that_rosbags_reads_bit_for_bit(wire: str, data: st.DataObject) -> None:
    encoding = wire.split("-")[0]
    made = data.draw(joint_types(encoding))
    messages = data.draw(joint_messages(made))
    payloads = [
        w.encode(w.Said("/x", made.name, 0, m), encoding, little=wire != "cdr-be", store=made.store) for m in messages
    ]
    schema_encoding = "ros2msg" if encoding == "cdr" else "ros1msg"
    channel = Channel(1, "/x", made.name, encoding, schema_encoding, made.text.encode())
    fast = decode(channel, JOINTS, payloads)
    read = made.store.deserialize_cdr if encoding == "cdr" else made.store.deserialize_ros1
    slow = decode(channel, JOINTS, payloads, lambda raw: lay_out(plain(read(raw, made.name))))
    assert (fast.seen, fast.skipped) == (slow.seen, slow.skipped)
    assert set(fast.groups) == set(slow.groups)
    for key, group in fast.groups.items():
        other = slow.groups[key]
        assert set(group.columns) == set(other.columns)
        order, other_order = (np.argsort(g.look("place")) for g in (group, other))
        for name in group.columns:
            mine, theirs = (g.look(name) for g in (group, other))
            assert mine[order].tobytes() == theirs[other_order].tobytes(), name
            assert mine.dtype == theirs.dtype


@pytest.mark.parametrize(("at", "expected"), [(0, True), (39_999, True), (None, False)])
def test_a_column_of_which_one_number_is_known_holds_something(at: int | None, expected: bool) -> None:
    out = Decoded()
    values = np.full((40_000, 2), np.nan)
    if at is not None:
        values[at, 1] = 0.0
    out.add(GroupKey(("a", "b"), (("effort", 2),), False), {"effort": values, "log_ns": np.arange(40_000)})
    (group,) = out.groups.values()
    assert (group.holds("effort"), group.holds("velocity")) == (expected, False)


def test_rows_stay_as_they_are_where_columns_grow() -> None:
    out = Decoded()
    rows = np.random.default_rng(0).normal(size=(30_000, 2))
    for part in np.array_split(np.arange(30_000), 7):
        out.add(GroupKey(("a", "b"), (("effort", 2),), False), {"effort": rows[part], "log_ns": part})
    (group,) = out.groups.values()
    assert group.rows == 30_000
    np.testing.assert_array_equal(group.look("effort"), rows)
    np.testing.assert_array_equal(group.look("log_ns"), np.arange(30_000))


@pytest.mark.parametrize("most", [0, 1, 3])
def test_messages_decoded_alone_are_those_decoded_together(most: int) -> None:
    said = [m for k in range(6) for m in w.motion(4, joints=1 + k, encoding="cdr", with_wrench=False)]
    channel = Channel(1, "/joint_states", w.JOINT_STATE, "cdr", "ros2msg", w.definition(w.JOINT_STATE, "cdr").encode())
    found = []
    for plans in (256, most):
        out = Decoded()
        decoder = ChannelDecoder(channel, JOINTS, out)
        decoder.max_plans = plans
        payloads = [w.encode(one, "cdr") for one in said]
        length = np.array([len(p) for p in payloads])
        data = np.frombuffer(b"".join(payloads), dtype=np.uint8)
        decoder.add(Batch(1, data, np.cumsum(length) - length, length, np.arange(len(payloads))))
        columns = {
            (key, name): np.asarray(group.look(name)) for key, group in out.groups.items() for name in group.columns
        }
        found.append({name: values.tobytes() for name, values in columns.items()})
    assert len(found[0]) == 6 * 7
    assert found[0] == found[1]
