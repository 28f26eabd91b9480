"""Functions called from Python with other arguments: they raise an ``InputError`` or work, and keep every promise."""

import json
import shlex

import pytest
from hypothesis import strategies as st

from tests.attack.python_calls import CALLS, VALUES
from tests.attack.victims import Victim

pytestmark = pytest.mark.attack

NEEDS = ("data", "network", "kriged", "field", "meshes", "powers", "csi")


def _attacks(name: str) -> st.SearchStrategy[tuple]:
    """Other values of one or two of a function's arguments."""
    arguments = st.sampled_from(sorted(CALLS[name]()))
    changes = st.dictionaries(arguments, st.sampled_from(sorted(VALUES)), min_size=1, max_size=2)
    call = changes.map(lambda each: f"python {name} {shlex.quote(json.dumps(each))}")
    return call.map(lambda each: (Victim("", each, (), NEEDS), lambda here: None))


@pytest.mark.parametrize("group", ["Python arguments"])
def test_arguments(group, tally):
    tally.attacks(st.sampled_from(sorted(CALLS)).flatmap(_attacks))
