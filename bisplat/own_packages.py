"""Let ``import simulate`` find our package, even if the user has a file simulate.py; likewise for scenes and learn.

The folder of the user's script comes first on Python's path, so Python would import the user's file in place of ours.
To prevent that, Python asks the finder in this module before it searches the path. The finder imports nothing early.
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

ROOT = Path(__file__).resolve().parents[1]
NAMES = ("scenes", "simulate", "learn")


def claim() -> None:
    """Reserve the three names for our packages in this process. Further calls change nothing."""
    for name in NAMES:
        taken = _place(sys.modules.get(name))
        if taken is not None and taken != ROOT / name:
            raise ImportError(
                f"bisplat needs its own package {name}, found {taken} imported under that name, which hides "
                f"{ROOT / name}; rename that file or folder, or import bisplat before it"
            )
    if not any(isinstance(finder, OwnPackages) for finder in sys.meta_path):
        sys.meta_path.insert(0, OwnPackages())


class OwnPackages:
    def find_spec(self, name: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name not in NAMES:
            return None
        file = str(ROOT / name / "__init__.py")
        return spec_from_file_location(name, file, loader=OwnLoader(name, file))


class OwnLoader(SourceFileLoader):
    """Loads one of our packages. If a name is missing in it, the error names the file that the package hides."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)

        def absent(attribute: str) -> NoReturn:
            hidden = None if attribute.startswith("__") else _hidden(module.__name__)
            hint = f", which hides {hidden}; give that file or folder another name" if hidden else ""
            raise AttributeError(f"{ROOT / module.__name__} of bisplat has no {attribute!r}{hint}")

        module.__getattr__ = absent  # type: ignore[method-assign]


def _hidden(name: str) -> Path | None:
    """The user's module of the same name, which Python would otherwise have imported; None: there is none."""
    for entry in sys.path:
        spec = PathFinder.find_spec(name, [entry])
        if spec is not None and spec.origin is not None:
            place = Path(spec.origin).resolve()
            if place.parent != ROOT / name:
                return place
    return None


def _place(module: ModuleType | None) -> Path | None:
    """The file of a module, or the folder of a package; None: it has not been imported."""
    if module is None:
        return None
    folders = list(getattr(module, "__path__", []))
    return Path(folders[0] if folders else getattr(module, "__file__", None) or module.__name__).resolve()
