"""Our ``dataclass`` is the standard library's in all that can be seen of it, but for what it compiles."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import inspect
import pickle
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import field
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import msgspec
import pytest
import samples

import collaudit.core
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.joint_log import JointLog
from collaudit.core.dataclass import dataclass as ours

Decorator = Callable[..., Any]


def kinds(dataclass: Decorator) -> SimpleNamespace:
    """The same classes, made by one decorator or the other."""

    @dataclass(frozen=True, slots=True)
    class Point:
        """A point."""

        shared: ClassVar[int] = 7
        x: float
        y: float = 2.0
        tags: tuple[str, ...] = field(default=(), compare=False)
        seen: list[int] = field(default_factory=list, repr=False, hash=False, compare=False)
        fixed: int = field(default=3, init=False)

        @property
        def sum(self) -> float:
            return self.x + self.y

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Named:
        """Arguments by name only, one of which is checked."""

        name: str
        size: int = 1

        def __post_init__(self) -> None:
            if self.size < 0:
                raise ValueError("less than nothing")
            object.__setattr__(self, "name", self.name.strip())

    @dataclass(frozen=True, slots=True)
    class Mixed:
        """One argument by name."""

        a: int
        b: int = field(kw_only=True)
        c: int = 5

    @dataclass(frozen=True, slots=True, eq=False)
    class Same:
        """Equal to nothing but itself."""

        value: Any

    @dataclass(frozen=True, slots=True)
    class Own:
        """Methods of its own."""

        value: int

        def __eq__(self, other: object) -> bool:
            return True

        def __repr__(self) -> str:
            return "own"

    @dataclass(frozen=True, slots=True)
    class Part:
        """Hashed by one of its fields."""

        key: int
        value: list[int] = field(hash=False)

    @dataclass(frozen=True, slots=True)
    class Empty:
        """Nothing."""

    @dataclass(frozen=True, slots=True, order=True)
    class Ordered:
        """With an order, which is left to the standard library."""

        value: int

    @dataclass(frozen=True, slots=True)
    class Heir(Point):
        """An heir, which is left to the standard library."""

        z: float = 0.0

    @dataclass(frozen=True)
    class Slow:
        """Without slots, left to the standard library."""

        value: int

        @cached_property
        def double(self) -> int:
            return 2 * self.value

    class Loose(Point):
        """An heir that is no dataclass."""

    return SimpleNamespace(**{name: kind for name, kind in locals().items() if name != "dataclass"})


#: What is done with the classes; outcomes and errors must be the same.
DEEDS: dict[str, Callable[[SimpleNamespace], object]] = {
    "repr": lambda k: [repr(x) for x in (k.Point(1.0), k.Named(name=" n "), k.Empty(), k.Own(1), k.Heir(1.0))],
    "equal": lambda k: (
        k.Point(1.0) == k.Point(1.0, tags=("a",)),
        k.Point(1.0) == k.Point(2.0),
        k.Point(1.0) == (1.0, 2.0),
        k.Point(1.0).__eq__(3),
        k.Point(1.0) == k.Heir(1.0),
        k.Empty() == k.Empty(),
        k.Own(1) == k.Own(2),
        k.Same(1) == k.Same(1),
    ),
    "hash": lambda k: (
        hash(k.Point(1.0)) == hash(k.Point(1.0, tags=("a",))),
        len({k.Point(1.0), k.Point(1.0), k.Point(2.0)}),
        len({k.Same(1), k.Same(1)}),
    ),
    "hashes": lambda k: [hash(x) for x in (k.Point(1.0), k.Mixed(1, b=2), k.Empty(), k.Part(1, [2]), k.Part(2, [2]))],
    "compared but not hashed": lambda k: (k.Part(1, [2]) == k.Part(1, [3]), k.Part(1, [2]) == k.Part(1, [2])),
    "unhashable": lambda k: hash(k.Mixed([], b=1)),
    "own equality has no hash": lambda k: k.Own.__hash__ is None,
    "class variable": lambda k: (k.Point.shared, k.Point(1.0).shared, k.Point(1.0).sum),
    "defaults": lambda k: (k.Point(1.0).seen is not k.Point(1.0).seen, k.Point(1.0).fixed, k.Point(1.0, seen=[1]).seen),
    "post init": lambda k: k.Named(name=" n ").name,
    "post init refuses": lambda k: k.Named(name="n", size=-1),
    "keyword only": lambda k: k.Named("n"),
    "mixed": lambda k: repr(k.Mixed(1, 2, b=3)),
    "too few": lambda k: k.Point(),
    "too many": lambda k: k.Empty(1),
    "unknown": lambda k: k.Point(1.0, depth=3),
    "not an argument": lambda k: k.Point(1.0, fixed=4),
    "set": lambda k: setattr(k.Point(1.0), "x", 3.0),
    "delete": lambda k: delattr(k.Point(1.0), "x"),
    "set by an heir": lambda k: setattr(k.Loose(1.0), "x", 2.0),
    "no other attributes": lambda k: hasattr(k.Point(1.0), "__dict__"),
    "replace": lambda k: repr(dataclasses.replace(k.Point(1.0, tags=("a",)), x=5.0)),
    "replace what is fixed": lambda k: dataclasses.replace(k.Point(1.0), fixed=5),
    "asdict": lambda k: (dataclasses.asdict(k.Point(1.0)), dataclasses.astuple(k.Mixed(1, b=2))),
    "fields": lambda k: [(f.name, f.type, f.kw_only, f.init) for f in dataclasses.fields(k.Point)],
    "parameters": lambda k: [
        (kind.__dataclass_params__.frozen, kind.__dataclass_params__.eq, kind.__dataclass_params__.init)
        for kind in (k.Point, k.Same)
    ],
    "match": lambda k: (k.Point.__match_args__, k.Mixed.__match_args__),
    "copies": lambda k: (copy.copy(k.Point(1.0)) == k.Point(1.0), copy.deepcopy(k.Point(1.0, seen=[1])).seen),
    "state": lambda k: k.Point(1.0).__getstate__(),
    "order": lambda k: k.Ordered(1) < k.Ordered(2),
    "without slots": lambda k: k.Slow(2).double,
    "names": lambda k: [c.__init__.__qualname__.rpartition(".")[2] for c in (k.Point, k.Named)],
    "msgspec": lambda k: repr(msgspec.json.decode('{"a": 1, "b": 2}', type=k.Mixed)),
    "msgspec refuses": lambda k: repr(msgspec.json.decode('{"a": "much", "b": 2}', type=k.Mixed)),
    "msgspec and post init": lambda k: msgspec.json.decode('{"name": " n "}', type=k.Named).name,
    "msgspec and what a class refuses": lambda k: msgspec.json.decode('{"name": "n", "size": -1}', type=k.Named),
}  # fmt: skip


@pytest.mark.parametrize("deed", DEEDS)
def test_it_does_as_the_standard_library(deed: str) -> None:
    outcomes = []
    for dataclass in (ours, dataclasses.dataclass):
        try:
            outcomes.append((DEEDS[deed](kinds(dataclass)), ""))
        except Exception as error:  # noqa: BLE001 (whatever it is, it must be the same)
            outcomes.append((type(error), str(error)))
    assert outcomes[0] == outcomes[1]


def test_attributes_that_are_no_fields() -> None:
    """Where the standard library stumbles over the class that its slots replaced (until Python 3.14)."""
    made = kinds(ours)
    with pytest.raises(dataclasses.FrozenInstanceError, match="depth"):
        made.Point(1.0).depth = 3
    loose = made.Loose(1.0)
    loose.depth = 3
    assert loose.depth == 3
    del loose.depth
    assert not hasattr(loose, "depth")


def test_an_object_that_holds_itself_is_shown() -> None:
    shown = []
    for dataclass in (ours, dataclasses.dataclass):
        made = kinds(dataclass).Same(None)
        object.__setattr__(made, "value", made)
        shown.append(repr(made))
    assert shown[0] == shown[1] and "..." in shown[0]


def test_init_is_compiled_once() -> None:
    kind = kinds(ours).Point
    before = kind.__init__
    kind(1.0)
    compiled = kind.__init__
    kind(2.0)
    assert before is not compiled and kind.__init__ is compiled


@ours(frozen=True, slots=True)
class Plain:
    """One that can be imported, as pickling asks for."""

    value: int
    names: tuple[str, ...] = ()


def test_it_is_pickled() -> None:
    assert pickle.loads(pickle.dumps(Plain(1, ("a",)))) == Plain(1, ("a",))
    audit = samples.passed(300).result
    assert pickle.loads(pickle.dumps(audit)) == audit


def every_class() -> list[type]:
    """All classes of the core that are made here."""
    top = Path(collaudit.core.__path__[0])
    for module in pkgutil.walk_packages([str(top)], "collaudit.core."):
        importlib.import_module(module.name)
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("collaudit.core.")]
    classes = {each for module in modules for each in vars(module).values() if inspect.isclass(each)}
    return [each for each in classes if getattr(each.__getstate__, "__name__", "") == "_state"]


def test_every_class_takes_the_arguments_that_the_standard_library_would_give_it() -> None:
    from collaudit.core.dataclass import _compiled_init

    made = every_class()
    assert len(made) > 250 and {AuditResult, JointLog} <= set(made)
    for kind in made:
        asked = [
            (
                f.name,
                f.type,
                field(default=f.default, default_factory=f.default_factory, init=f.init, kw_only=f.kw_only),
            )
            for f in dataclasses.fields(kind)
        ]
        twin = dataclasses.make_dataclass(kind.__name__, asked, frozen=True)
        found, wanted = inspect.signature(_compiled_init(kind)), inspect.signature(twin.__init__)
        shape = [
            [(p.name, p.kind, p.default is p.empty) for p in list(signature.parameters.values())[1:]]
            for signature in (found, wanted)
        ]
        assert shape[0] == shape[1], kind


def test_importing_compiles_few_methods() -> None:
    """Of the results' classes, those that have an order or bases are left to the standard library."""
    code = (
        "import dataclasses\n"
        "asked, standard = [], dataclasses._process_class\n"
        "def seen(cls, init, *rest):\n"
        "    asked.append(init)\n"
        "    return standard(cls, init, *rest)\n"
        "dataclasses._process_class = seen\n"
        "import collaudit.core.data.audit_result\n"
        "assert len(asked) > 60 and sum(asked) < 10, (len(asked), sum(asked))\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("dataclass", [dataclasses.dataclass, ours])
def test_a_field_without_default_after_one_with_it_is_refused(dataclass: Decorator) -> None:
    for default in (field(default=1), field(default_factory=list)):
        given = {"x": default, "__annotations__": {"x": "int", "y": "int"}, "__doc__": "Two."}
        with pytest.raises(TypeError, match=r"non-default argument 'y' follows default argument( 'x')?"):
            dataclass(frozen=True, slots=True)(type("Two", (), dict(given)))
        named = dataclass(frozen=True, slots=True, kw_only=True)(type("Two", (), dict(given)))
        assert named(y=2, x=3).y == 2


@pytest.mark.parametrize("dataclass", [dataclasses.dataclass, ours])
def test_fields_may_have_any_name(dataclass: Decorator) -> None:
    names = ("self_", "_set", "_absent", "_make0", "_default0", "cls", "known")
    given = {"__annotations__": dict.fromkeys(names, "int"), "__doc__": "Odd names."}
    odd = dataclass(frozen=True, slots=True)(type("Odd", (), given | {"known": field(default_factory=int)}))
    made = odd(*range(6))
    assert [getattr(made, name) for name in names] == [0, 1, 2, 3, 4, 5, 0]
