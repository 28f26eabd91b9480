"""The documentation builds without a warning, and is complete."""

import re
import subprocess
import sys

import pytest

from tests.docs.api_pages import documented, undocumented, without_example
from tests.docs.pages import PAGES, ROOT, words_of_readme


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", ROOT / "docs", tmp_path / "site"]
    done = subprocess.run([*command, "-d", tmp_path / "doctrees"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-5000:]


def test_every_public_name_is_documented_once():
    assert len(documented()) == len(set(documented()))
    assert not undocumented()


def test_every_public_name_has_an_example():
    assert not without_example()


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
    assert words_of_readme() <= 600
