"""docs/references.bib has what docstrings and pages cite, and nothing else."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ENTRIES = dict(re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", (ROOT / "docs" / "references.bib").read_text(), re.M | re.S))
FOLDERS = ("bisplat", "scenes", "simulate", "learn", "benchmarks")
PATHS = [*(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")), *ROOT.glob("docs/**/*.md")]
TEXTS = {str(path.relative_to(ROOT)): path.read_text() for path in PATHS}

KEY = re.compile(r"(?:\[|\{cite:\w\}`)([a-z]+\d{4}[a-z]?)[\]`]")
"""As docstrings and as pages cite: [key], {cite:p}`key`."""

NAME_AND_YEAR = re.compile(r"[A-Z]\w+(?: et al\.)?,? \(?(?:19|20)\d\d\)")
"""Such as (Yee 1966) or Yee (1966)."""


def test_every_citation_has_an_entry_and_every_entry_is_cited():
    cited = {key: path for path, text in TEXTS.items() for key in KEY.findall(text)}
    assert not {key: path for key, path in cited.items() if key not in ENTRIES}
    assert not ENTRIES.keys() - cited.keys()


@pytest.mark.parametrize("key", ENTRIES)
def test_entry_has_author_title_and_the_year_of_its_key(key):
    fields = dict(re.findall(r"^  (\w+) = \{(.*)\},?$", ENTRIES[key], re.M))
    assert fields["author"] and fields["title"] and fields["year"] == re.sub(r"\D", "", key)
    assert len(fields) == len(ENTRIES[key].splitlines())


def test_nothing_is_cited_by_name_and_year():
    assert not {path: found[0] for path, text in TEXTS.items() if (found := NAME_AND_YEAR.findall(text))}
