"""Functions called from Python with other arguments: they raise an ``InputError`` or work, and keep every promise."""

import json
import shlex

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.attack.python_calls import CALLS, VALUES
from tests.attack.victims import Victim

pytestmark = pytest.mark.attack

NEEDS = ("data", "network", "kriged", "field", "meshes", "powers", "csi")


def _changes(name: str) -> st.SearchStrategy[tuple[str, dict[str, str]]]:
    """Other values of one or two of a function's arguments."""
    arguments = st.sampled_from(sorted(CALLS[name]()))
    return st.tuples(st.just(name), st.dictionaries(arguments, st.sampled_from(sorted(VALUES)), min_size=1, max_size=2))


@pytest.mark.parametrize("group", ["Python arguments"])
def test_arguments(group, tally):
    @given(st.sampled_from(sorted(CALLS)).flatmap(_changes))
    def run(drawn) -> None:
        name, changes = drawn
        tally.attack(Victim("", f"python {name} {shlex.quote(json.dumps(changes))}", (), NEEDS), lambda here: None)

    run()
    tally.finish()
