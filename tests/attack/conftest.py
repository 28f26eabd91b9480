"""How many attacks there are, the folder they happen in, and the table of what came of them."""

from __future__ import annotations

import json
import os
import subprocess
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from tests.attack.fork_server import ForkServer
from tests.attack.workplace import Workplace

TABLE = "attack"  # Name of the property of a test that holds its counts

FIELD = Path(__file__).parents[1] / "data" / "closet"

OUTCOMES = ("refused", "accepted", "failed")

EXAMPLES = int(os.environ.get("BISPLAT_ATTACKS", "25"))  # Number of attacks of each group

settings.register_profile(
    "attack",
    max_examples=EXAMPLES,
    deadline=None,
    derandomize="BISPLAT_ATTACKS" not in os.environ,  # the suite's are the same every time
    database=None,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.explicit, Phase.generate],
)
settings.load_profile("attack")


class Tally:
    """What came of the attacks of a group."""

    def __init__(self, workplace: Workplace, kept: Path) -> None:
        self._workplace, self._kept = workplace, kept
        self.outcomes: Counter[str] = Counter()
        self.failures: list[str] = []

    def attack(self, *arguments) -> None:
        """``Workplace.attack`` with these arguments; a broken promise is noted, and the attacks go on."""
        try:
            self.outcomes[self._workplace.attack(*arguments)] += 1
        except AssertionError as failure:
            self.outcomes["failed"] += 1
            kept = self._kept / f"{len(self.failures)}"
            subprocess.run(["cp", "-a", str(self._workplace.here), str(kept)], check=True)
            self.failures.append(f"{failure}\n  files: {kept}")

    def attacks(self, drawn: st.SearchStrategy[tuple]) -> None:
        """``attack`` with each of the arguments drawn; fails in the end if a promise was broken."""

        @given(drawn)
        def run(arguments: tuple) -> None:
            self.attack(*arguments)

        run()
        assert not self.failures, f"{len(self.failures)} broken promises:\n" + "\n".join(self.failures[:30])


@pytest.fixture(scope="session")
def workplace(tmp_path_factory) -> Iterator[Workplace]:
    """Valid files, and a process that runs commands on changed ones."""
    folder = tmp_path_factory.mktemp("attack")
    temporary, settings = folder / "temporary", folder / "settings"
    temporary.mkdir()
    settings.mkdir()
    with ForkServer(temporary, settings) as server:
        yield Workplace(folder, server, FIELD)


@pytest.fixture
def tally(workplace, tmp_path, record_property) -> Iterator[Tally]:
    """Counts of the attacks of one test."""
    counts = Tally(workplace, tmp_path)
    yield counts
    record_property(TABLE, dict(counts.outcomes))


def pytest_terminal_summary(terminalreporter) -> None:
    """Print the table, and write it to the file that BISPLAT_ATTACK_TABLE names."""
    rows = {
        report.nodeid.rpartition("[")[2].rstrip("]"): Counter(counts)
        for reports in terminalreporter.stats.values()
        for report in reports
        for name, counts in getattr(report, "user_properties", ())
        if name == TABLE
    }
    if "BISPLAT_ATTACKS" not in os.environ or not rows:
        return
    table = {
        name: {"tried": sum(counts.values())} | {each: counts[each] for each in OUTCOMES}
        for name, counts in rows.items()
    }
    table["all"] = {each: sum(row[each] for row in table.values()) for each in ("tried", *OUTCOMES)}
    terminalreporter.write_line(f"{'':30}" + "".join(f"{each:>10}" for each in table["all"]))
    for name, row in table.items():
        terminalreporter.write_line(f"{name:30}" + "".join(f"{each:10}" for each in row.values()))
    if path := os.environ.get("BISPLAT_ATTACK_TABLE"):
        Path(path).write_text(json.dumps(table, indent=2) + "\n")
