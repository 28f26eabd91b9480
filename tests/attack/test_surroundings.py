"""Folders of other programs, parts that do not belong together, outputs in the way: nothing is lost, all is told."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.attack import foreign, planted
from tests.attack.victims import PLACE, Victim

pytestmark = pytest.mark.attack

CONVERT = Victim("", "convert measured -o out", (), ("measured",), then="check out")
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


@pytest.mark.parametrize("group", ["foreign pictures"])
def test_foreign_pictures(group, tally):
    @given(st.sampled_from((CONVERT, CONVERT, CHECK)), foreign.pictures())
    def run(victim, change) -> None:
        tally.attack(victim, change)

    run()
    tally.finish()


@pytest.mark.parametrize("group", ["metadata by hand"])
def test_metadata(group, tally):
    @given(st.sampled_from((CONVERT, CHECK)), foreign.metadata())
    def run(victim, change) -> None:
        tally.attack(victim, change)

    run()
    tally.finish()


@pytest.mark.parametrize("group", ["pairs"])
def test_pairs(group, tally):
    @given(st.sampled_from(PAIRS), foreign.swapped(("data", "network", "compared"), ("others", "data", "network")))
    def run(victim, change) -> None:
        tally.attack(victim, change)

    run()
    tally.finish()


def _command(command: str, output: str) -> str:
    """A command with its output."""
    place = PLACE if command.startswith("scene meshes") else ""
    return f"{command} {output} {place}" if command.endswith("--hdf5") else f"{command} -o {output} {place}"


@pytest.mark.parametrize("group", ["planted links"])
def test_planted_links(group, tally):
    @given(st.sampled_from(sorted(planted.OUTPUTS)), st.data())
    def run(command, data) -> None:
        output = planted.OUTPUTS[command]
        change = data.draw(planted.links(output))
        tally.attack(Victim("", _command(command, output), (), NEEDS, (output,)), change)

    run()
    tally.finish()


@pytest.mark.parametrize("group", ["outputs in the way"])
def test_outputs(group, tally):
    @given(st.sampled_from(sorted(planted.OUTPUTS)), st.data(), st.booleans())
    def run(command, data, force) -> None:
        name, change = data.draw(planted.in_the_way(planted.OUTPUTS[command]))
        forced = " --force" if force and command.split()[0] in ("predict", "export", "scene", "plan") else ""
        tally.attack(Victim("", _command(command, name) + forced, (), NEEDS, (name.split("/")[0],)), change)

    run()
    tally.finish()
