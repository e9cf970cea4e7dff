"""Single compiled functions of SciPy, loaded from their file without the packages around them.

``scipy.signal`` and ``scipy.optimize`` take longer to import than a minute of log takes to judge: each loads most of
SciPy. Where one compiled function of theirs is all that is needed, it is loaded alone, tried on a case whose answer is
known, and given up for the public function where it is missing or does not agree (SciPy may rename it at any time).
"""

from __future__ import annotations

import importlib.machinery
import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

#: What a function of another signature or another meaning raises when it is tried.
_REFUSALS = (TypeError, ValueError, IndexError, NotImplementedError)


def compiled_function(stem: str, name: str, agrees: Callable[[Any], bool]) -> Any | None:
    """A function of a compiled module of SciPy; None where there is none that agrees.

    Args:
        stem: the module's file below the package, without the platform's suffix, ``signal/_sigtools`` say.
        name: of the function in it.
        agrees: tries the function on a case whose answer is known.
    """
    function = getattr(compiled_module(stem, Path(stem).name), name, None)
    if function is None:
        return None
    try:
        return function if agrees(function) else None
    except _REFUSALS:
        return None


def compiled_module(stem: str, name: str) -> ModuleType | None:
    """A compiled module of SciPy, loaded under a name; None where it is missing or does not load.

    Args:
        stem: the module's file below the package, without the platform's suffix.
        name: what the module is to be called.
    """
    found = importlib.util.find_spec("scipy")
    for folder in (found.submodule_search_locations if found else None) or ():
        for suffix in importlib.machinery.EXTENSION_SUFFIXES:
            path = Path(folder) / f"{stem}{suffix}"
            if path.is_file():
                return _loaded(name, path)
    return None


def _loaded(name: str, path: Path) -> ModuleType | None:
    loader = importlib.machinery.ExtensionFileLoader(name, str(path))
    spec = importlib.util.spec_from_loader(name, loader)
    try:
        module = importlib.util.module_from_spec(spec) if spec else None
        if module is not None:
            loader.exec_module(module)
    except ImportError:
        return None
    return module
