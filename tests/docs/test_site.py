"""The documentation builds without a warning, and is complete."""

import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import bisplat
from tests.docs.pages import PAGES, ROOT

KINDS = ("start", "how-to", "understand", "reference")


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", ROOT / "docs", tmp_path / "site"]
    done = subprocess.run([*command, "-d", tmp_path / "doctrees"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-5000:]


def test_every_public_name_is_documented_once():
    text = "".join(path.read_text() for path in (ROOT / "docs" / "reference" / "api").glob("*.md"))
    named = re.findall(r"^\.\. auto(?:function|class|exception):: ([\w.]+)$", text, re.M)
    assert len(named) == len(set(named))
    assert not set(bisplat.__all__) - {"shapes", *(name.partition(".")[0] for name in named)}
    assert {f"scenes.scene.shapes.{name}" for name in public(bisplat.shapes)} <= set(named)


def test_every_public_name_has_an_example():
    assert not [name for name in bisplat.__all__ if ">>> " not in example_of(name)]


def public(module: ModuleType) -> list[str]:
    """Names of the functions that a module defines for others."""
    functions = inspect.getmembers(module, inspect.isfunction)
    return [name for name, each in functions if each.__module__ == module.__name__ and not name.startswith("_")]


def example_of(name: str) -> str:
    thing = getattr(bisplat, name)
    return Path(inspect.getsourcefile(thing)).read_text() if inspect.ismodule(thing) else thing.__doc__ or ""


def test_no_page_points_out_of_the_repository():
    """Readers have neither the founders' folders nor their machine."""
    outside = {page for page, path in PAGES.items() if re.search(r"\.\./shared|/work/", path.read_text())}
    assert not outside


def test_relative_links_lead_to_files():
    """Sphinx checks links between pages; these are of README.md, and those that lead out of docs/."""
    broken = []
    for page, path in PAGES.items():
        for target in re.findall(r"\]\((?!https?:|#|mailto:)([^)#\s]+)", path.read_text()):
            if not (path.parent / target).exists():
                broken.append(f"{page}: {target}")
    assert not broken


def test_the_readme_is_short():
    words = re.sub(r"```.*?```|<!--.*?-->", "", PAGES["README.md"].read_text(), flags=re.S).split()
    assert len(words) <= 600
