"""Joints whose values a message lists by interface: one item a joint, or one name a joint and interface."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.logs.messages.decoded_columns import MOTION
from collaudit.core.logs.messages.layout import MISSING, Numbers
from collaudit.core.vendors.message_profiles import INTERFACES

Runs = tuple[Numbers, ...]
_MOTION = (*MOTION, "current")


def joints_of_items(named: tuple[str, ...], found: dict[str, Runs]) -> tuple[tuple[str, ...], dict[str, Runs]]:
    """Of a list of interfaces the joints: items that have a position, a velocity or an effort; the others are none.

    Args:
        named: name of each item.
        found: quantity to one run an item, :data:`MISSING` of those that lack it; empty where all do.
    """
    motion = [found[name] for name in _MOTION if found.get(name)]
    if any(len(runs) != len(named) for runs in found.values() if runs):
        return named, found
    kept = [k for k in range(len(named)) if any(runs[k] is not MISSING for runs in motion)]
    return tuple(named[k] for k in kept), {name: tuple(runs[k] for k in kept if runs) for name, runs in found.items()}


def joints_of_names(named: tuple[str, ...], found: dict[str, Runs]) -> tuple[tuple[str, ...], dict[str, Runs]]:
    """Joints of names such as ``joint1/position`` and ``joint1/effort``, each with its interface's value.

    It stands in the array of its quantity, or in the first array of the message where that has none of the quantity.

    Args:
        named: names as the message lists them; anything but joint and interface is left as it is.
        found: quantity to its runs, one number a name.
    """
    pairs = next(filter(_tell_quantities, ([name.rpartition(mark) for name in named] for mark in "/._")), None)
    if pairs is None:
        return named, found
    told = {INTERFACES[interface] for _, _, interface in pairs if interface in INTERFACES}
    values = {quantity: _each(runs) for quantity, runs in found.items() if runs}
    if any(len(numbers) != len(named) for numbers in values.values()):
        return named, found
    first = next((values[quantity] for quantity in MOTION if quantity in values), ())
    joints = tuple(dict.fromkeys(joint for joint, _, interface in pairs if interface in INTERFACES))
    out: dict[str, Runs] = {}
    for quantity in told:
        numbers = values.get(quantity, first)
        own = {joint: run for (joint, _, interface), run in zip(pairs, numbers, strict=True)
               if INTERFACES.get(interface) == quantity}  # fmt: skip
        out[quantity] = tuple(own.get(joint, MISSING) for joint in joints)
    return joints, {**{name: runs for name, runs in found.items() if name not in _MOTION}, **out}


def _tell_quantities(pairs: Sequence[tuple[str, str, str]]) -> bool:
    """Whether names are joints with a word of a quantity behind each, of positions and of another."""
    told = {INTERFACES.get(interface) for _, _, interface in pairs}
    return all(joint for joint, _, _ in pairs) and "position" in told and len(told - {None}) > 1


def _each(runs: Runs) -> Runs:
    """Runs of numbers as runs of one number each."""
    return tuple(Numbers(run.offset + k * int(run.code[2:]), run.code, 1) for run in runs for k in range(run.count))
