"""Our ``dataclass`` answers as the standard one does."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from typing import Any, get_type_hints

import pytest
from pydantic import TypeAdapter

from collaudit.core.value_types import value_type

Make = Callable[..., Callable[[type[Any]], type[Any]]]


def _classes(make: Make) -> dict[str, type[Any]]:
    """Classes with every option that the code uses."""

    @make(frozen=True, slots=True)
    class Plain:
        """A value."""

        a: int
        b: tuple[float, ...] = (1.0,)
        c: dict[str, int] = field(default_factory=dict)
        d: str = field(default="d", compare=False, repr=False)

        @property
        def twice(self) -> int:
            return 2 * self.a

    @make(frozen=True, slots=True)
    class Derived(Plain):
        """A value with one more field."""

        e: float = 0.5

    @make(frozen=True, slots=True)
    class Late:
        """A value with fields that are set afterwards."""

        a: int
        b: int = field(init=False)
        c: list[int] = field(init=False, default_factory=list)
        d: int = field(init=False, default=4)

        def __post_init__(self) -> None:
            object.__setattr__(self, "b", self.a + 1)

    @make(frozen=True, slots=True, kw_only=True)
    class Named:
        """A value whose fields are named."""

        a: int
        b: int = 2

    @make(frozen=True, slots=True, eq=False)
    class Same:
        """Equal to nothing but itself."""

        a: int

    @make(slots=True)
    class Open:
        """May be changed."""

        a: int
        b: list[int] = field(default_factory=list)
        c: int = field(default=0, kw_only=True)

    @make(frozen=True, slots=True, order=True)
    class Ordered:
        """Has an order."""

        a: int
        b: int = 0

    @make(frozen=True)
    class Loose:
        """Has a dictionary, and no fields."""

    @make(frozen=True, slots=True)
    class Own:
        """Says itself how it looks and what it is equal to."""

        a: int

        def __repr__(self) -> str:
            return "own"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, type(self))

    found = [Plain, Derived, Late, Named, Same, Open, Ordered, Loose, Own]
    return {made.__name__: made for made in found}


OURS, STANDARD = _classes(value_type), _classes(dataclasses.dataclass)

CALLS: dict[str, list[tuple[tuple[Any, ...], dict[str, Any]]]] = {
    "Plain": [((1,), {}), ((1, (2.0,)), {"c": {"x": 1}, "d": "e"}), ((), {}), ((1,), {"z": 3}), ((1,), {"a": 1})],
    "Derived": [((1,), {"e": 2.0}), ((1, (), {}, "d", 3.0), {}), ((1, 2, 3, 4, 5, 6), {})],
    "Late": [((1,), {}), ((1, 2), {})],
    "Named": [((), {"a": 1}), ((1,), {})],
    "Same": [((1,), {}), ((), {})],
    "Open": [((1, [2]), {"c": 3}), ((1,), {}), ((1, [], 3), {})],
    "Ordered": [((1, 2), {}), ((0, 3), {})],
    "Loose": [((), {})],
    "Own": [((1,), {})],
}


def _answer(action: Callable[[], Any]) -> object:
    try:
        return action()
    except (TypeError, ValueError, FrozenInstanceError, AttributeError) as error:
        return type(error), str(error)


def _put(value: Any, name: str) -> object:
    setattr(value, name, 5)
    return repr(value)


def _taken(value: Any, name: str) -> object:
    delattr(value, name)
    return [hasattr(value, item.name) for item in dataclasses.fields(value)]


QUESTIONS: dict[str, Callable[[type[Any], Any], object]] = {
    "repr": lambda _, value: repr(value),
    "equal": lambda _, value: (value == copy.copy(value), value == 3, value != value),
    "hash": lambda kind, value: hash(value) if kind.__eq__ is not object.__eq__ else hash(value) == hash(value),
    "fields": lambda _, value: [(f.name, f.type, f.kw_only, f.init) for f in dataclasses.fields(value)],
    "asdict": lambda _, value: dataclasses.asdict(value),
    "replace": lambda _, value: repr(dataclasses.replace(value, a=7)),
    "replace late": lambda _, value: repr(dataclasses.replace(value, b=7)),
    "set": lambda _, value: _put(value, "a"),
    "set another": lambda _, value: _put(value, "other") if type(value).__name__ in ("Open", "Loose") else None,
    "delete": lambda _, value: _taken(value, "a"),
    "deep copy": lambda _, value: repr(copy.deepcopy(value)),
    "state": lambda _, value: repr(value.__reduce_ex__(2)[2]),
    "slots": lambda kind, value: (kind.__slots__ if hasattr(kind, "__slots__") else None, hasattr(value, "__dict__")),
    "signature": lambda kind, _: str(inspect.signature(kind)),
    "hints": lambda kind, _: get_type_hints(kind.__init__),
    "pattern": lambda kind, _: kind.__match_args__,
    "order": lambda kind, value: value < kind(9) if kind.__name__ == "Ordered" else None,
}


@pytest.mark.parametrize("name", list(OURS))
def test_construction_answers_as_the_standard_one(name: str) -> None:
    for _ in range(2):
        for args, named in CALLS[name]:
            ours, standard = (
                _answer(lambda k=kind, a=args, n=named: repr(k[name](*a, **n))) for kind in (OURS, STANDARD)
            )
            assert ours == standard
        assert inspect.isfunction(OURS[name].__init__)  # which is compiled from now on


def test_a_default_that_is_made_is_made_each_time() -> None:
    kind = _classes(value_type)["Plain"]
    assert kind(1).c is not kind(1).c
    assert kind(1, c={}).c == {}


@pytest.mark.parametrize("question", list(QUESTIONS))
@pytest.mark.parametrize("name", list(OURS))
def test_a_value_answers_as_the_standard_one(name: str, question: str) -> None:
    args, named = CALLS[name][0]
    answers = []
    for kinds in (OURS, STANDARD):
        kind = kinds[name]
        value = kind(*args, **named)
        answers.append(_answer(lambda k=kind, v=value: QUESTIONS[question](k, v)))
    assert answers[0] == answers[1]


def test_values_are_hashed_by_their_fields() -> None:
    kind = value_type(frozen=True, slots=True)(
        type("Key", (), {"__annotations__": {"a": int, "b": str}, "__doc__": "x"})
    )
    assert {kind(1, "x"): 1}[kind(1, "x")] == 1
    assert kind(1, "x") != kind(1, "y")


@value_type(frozen=True, slots=True)
class Kept:
    """A value that is pickled and validated."""

    a: int
    b: tuple[float, ...] = ()


def test_values_are_pickled_and_validated() -> None:
    value = Kept(1, (2.0,))
    assert pickle.loads(pickle.dumps(value)) == value
    assert TypeAdapter(Kept).validate_json('{"a": 1, "b": [2.0]}', strict=True) == value


def test_a_constructor_is_compiled_for_many() -> None:
    kind = value_type(frozen=True, slots=True)(type("Rare", (), {"__annotations__": {"a": int}}))
    made = [kind(k) for k in range(5)]
    assert not inspect.isfunction(kind.__dict__["__init__"])
    made += [kind(a=k) for k in range(5, 100)]
    assert inspect.isfunction(kind.__dict__["__init__"])
    assert [value.a for value in made] == list(range(100))
