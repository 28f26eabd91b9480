"""Folders of other programs, parts that do not belong together, outputs in the way: nothing is lost, all is told."""

import pytest
from hypothesis import strategies as st

from tests.attack import foreign, planted
from tests.attack.victims import PLACE, Victim

pytestmark = pytest.mark.attack

CONVERT = Victim("", "dataset measured -o out", (), ("measured",), then="check out")
CHECK = Victim("", "check measured", (), ("measured",), ())

PAIRS = (
    Victim("", "check data", (), ("data", "others", "network"), ()),
    Victim("", "train data -o out --model mlp-responses --steps 2 --batch-size 2", (), ("data", "others"), ("out",)),
    Victim("", "predict network --positions places.csv -o out", (), ("data", "others", "network", "places.csv")),
    Victim("", "compare data -o compared --models nearest", (), ("data", "others", "compared"), ("compared",)),
    Victim("", "simulate closet -n 3 -o out --engine fullwave --field data", (), ("data", "others")),
    Victim("", "plan network -n 2 -o out", (), ("data", "others", "network")),
    Victim("", "simulate data -o out --field data", (), ("data", "others")),
)
"""Commands that take several files; ``others`` is a dataset of another place."""

NEEDS = ("data", "network", "kriged", "measured", "field", "room", "meshes", "recordings", "places.csv", "gateways.yml")


def _command(command: str, output: str) -> str:
    """A command with its output."""
    place = PLACE if command.startswith("scene meshes") else ""
    return f"{command} {output} {place}" if command.endswith("--hdf5") else f"{command} -o {output} {place}"


@st.composite
def _planted_links(draw) -> tuple:
    command, output = draw(st.sampled_from(sorted(planted.OUTPUTS.items())))
    return Victim("", _command(command, output), (), NEEDS, (output,)), draw(planted.links(output))


@st.composite
def _outputs(draw) -> tuple:
    command, output = draw(st.sampled_from(sorted(planted.OUTPUTS.items())))
    name, change = draw(planted.in_the_way(output))
    forced = " --force" if draw(st.booleans()) and command.split()[0] in ("predict", "export", "scene", "plan") else ""
    return Victim("", _command(command, name) + forced, (), NEEDS, (name.split("/")[0],)), change


SURROUNDINGS = {
    "foreign pictures": st.tuples(st.sampled_from((CONVERT, CONVERT, CHECK)), foreign.pictures()),
    "metadata by hand": st.tuples(st.sampled_from((CONVERT, CHECK)), foreign.metadata()),
    "pairs": st.tuples(
        st.sampled_from(PAIRS), foreign.swapped(("data", "network", "compared"), ("others", "data", "network"))
    ),
    "planted links": _planted_links(),
    "outputs in the way": _outputs(),
}


@pytest.mark.parametrize("group", SURROUNDINGS)
def test_surroundings(group, tally):
    tally.attacks(SURROUNDINGS[group])
