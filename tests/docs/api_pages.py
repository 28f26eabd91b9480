"""What the pages of docs/reference/api document."""

import inspect
import re
from pathlib import Path

import bisplat
from tests.docs.pages import ROOT


def documented() -> list[str]:
    """Names that the pages document, as they write them."""
    text = "".join(path.read_text() for path in (ROOT / "docs" / "reference" / "api").glob("*.md"))
    return re.findall(r"^\.\. auto(?:function|class|exception):: ([\w.]+)$", text, re.M)


def undocumented() -> set[str]:
    """Public names, and functions of the public module shapes, that no page documents."""
    wanted = {name for name in bisplat.__all__ if not inspect.ismodule(getattr(bisplat, name))}
    functions = inspect.getmembers(bisplat.shapes, inspect.isfunction)
    home = bisplat.shapes.__name__
    wanted |= {f"{home}.{name}" for name, each in functions if each.__module__ == home and not name.startswith("_")}
    return wanted - set(documented())


def without_example() -> set[str]:
    """Public names whose docstring has no example; those of a module stand in its functions."""
    texts = {}
    for name in bisplat.__all__:
        thing = getattr(bisplat, name)
        texts[name] = Path(thing.__file__).read_text() if inspect.ismodule(thing) else thing.__doc__ or ""
    return {name for name, text in texts.items() if ">>> " not in text}
