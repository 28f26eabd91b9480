"""Files changed at random: a command refuses them in one sentence or takes them, and keeps every promise."""

import pytest
from hypothesis import strategies as st

from tests.attack.dataset_victims import KINDS
from tests.attack.victims import GROUPS

ATTACKED = GROUPS | KINDS

pytestmark = pytest.mark.attack


@pytest.mark.parametrize("group", ATTACKED)
def test_valid_files_are_taken(group, workplace):
    for victim in ATTACKED[group]:
        assert workplace.attack(victim, lambda folder: None) == "accepted"


@pytest.mark.parametrize("group", ATTACKED)
def test_changed_files(group, workplace, tally):
    def attacks(victim):
        def replaced(make):
            return victim, lambda folder: ((folder / victim.file).unlink(), make(folder / victim.file))

        return victim.contents(workplace.whole).map(replaced)

    tally.attacks(st.sampled_from(ATTACKED[group]).flatmap(attacks))
