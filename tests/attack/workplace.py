"""The folder in which the commands run: valid files, made once, put back before each attack, and looked at after it."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scenes.files.atomic import is_temporary
from scenes.files.output_folder import LOCK
from tests.attack.dataset_victims import make_kinds
from tests.attack.fork_server import LONGEST, MOST_MEMORY, Ended, ForkServer
from tests.attack.victims import Victim, make_files

OF_ANOTHER_PLACE = Path(__file__).parents[1] / "data" / "workshop"  # A field of another place

VALID = (
    "simulate closet -n 8 -o data --engine fullwave --field field",
    f"simulate workshop -n 8 -o others --engine fullwave --field {OF_ANOTHER_PLACE}",
    "train data -o kriged",
    "train data -o network --model mlp-responses --steps 2 --batch-size 2",
    "train data -o begun --model mlp-responses --steps 4 --batch-size 2",
    "compare data -o compared --models nearest",
    "compare powers -o scored --split random --methods mean",
)
"""Commands that make the other valid files."""

SIMULATED = ("metadata.json", "channels.npz", "field.npz", "scene")
"""Files of a dataset that a measured one does not have."""


class Workplace:
    """Valid files, and a folder in which they are changed and read."""

    def __init__(self, folder: Path, server: ForkServer, field: Path) -> None:
        self.whole, self.here, self.temporary = (
            folder / "whole",
            folder / "here",
            folder / "temporary",
        )  # TMPDIR of the commands
        self._server = server
        self.here.mkdir()  # run folders hold the path of their dataset
        make_files(self.here, field)
        make_kinds(self.here)
        for command in VALID:
            ended = server.run(command.split(), self.here)
            assert ended.status == 0, ended.said
        shutil.copytree(self.here / "data", self.here / "measured", ignore=shutil.ignore_patterns(*SIMULATED))
        for name in ("weights.safetensors", "training.json"):
            (self.here / "begun" / name).unlink()
        shutil.copytree(self.here, self.whole)

    def attack(
        self, victim: Victim, change: Callable[[Path], object], check: Callable[[Path], None] = lambda here: None
    ) -> str:
        """Run a command on changed files, and another one where the first took them."""
        shutil.rmtree(self.here)
        self.here.mkdir()
        for name in victim.needs:
            source = self.whole / name
            (shutil.copytree if source.is_dir() else shutil.copy)(source, self.here / name)
        change(self.here)
        outcome = self._run(shlex.split(victim.command), victim.output)
        if outcome == "accepted":
            check(self.here)
        if victim.then is not None and outcome == "accepted":
            second = self._run(shlex.split(victim.then), victim.output)
            assert second == "accepted" or victim.then != "check out", f"converted to no dataset: {self._said[-500:]}"
        return outcome

    def _run(self, command: list[str], output: tuple[str, ...]) -> str:
        before, temporary, leftovers = self._seen(output), set(self.temporary.iterdir()), self._leftovers()
        ended = self._server.run(command, self.here)
        story = f"{shlex.join(command)[:300]}: {ended}"
        assert not ended.hung, f"hung: {story}"
        assert ended.status == 0 or ended.seconds < LONGEST, f"took longer than {LONGEST:g} s to refuse: {story}"
        assert ended.megabytes < MOST_MEMORY, f"took too much memory: {story}"
        assert ended.status in (0, 1, 2), f"ended with another status: {story}"
        assert "Traceback" not in ended.said and "Warning" not in ended.said, f"said more than a sentence: {story}"
        said = ended.said if ended.status != 2 else ended.said.replace("\t", "")  # the parser repeats what was typed
        assert all(line.isprintable() for line in said.splitlines()), f"control characters: {story}"
        assert self._seen(output) == before, f"wrote outside of its output: {story}"
        new = {path.name for path in self.temporary.iterdir() if path not in temporary}
        assert not new, f"left temporary files {new}: {story}"
        left = self._leftovers() - leftovers
        assert not left, f"left {left}: {story}"
        self._said = ended.said
        if ended.status != 0:
            self._check_sentence(command, ended, story)
            return "refused"
        if command[0] == "predict":
            self._check_predictions(*output, story)
        return "accepted"

    def _leftovers(self) -> set[str]:
        """Names of files that only unfinished work needs."""
        return {path.name for path in self.here.rglob("*") if path.name == LOCK or is_temporary(path.name)}

    def _seen(self, output: tuple[str, ...]) -> dict[str, object]:
        """What is in the folder apart from the output; and, where files are huge or no files, what they are."""
        seen: dict[str, object] = {}
        for path in sorted(self.here.rglob("*")):
            name = str(path.relative_to(self.here))
            if name.split("/")[0] in output:
                continue
            state = path.lstat()
            small = path.is_file() and not path.is_symlink() and state.st_size < 10**8
            seen[name] = path.read_bytes() if small else (state.st_mode, state.st_size, state.st_ino)
        return seen

    def _check_predictions(self, output: str, story: str) -> None:
        place = self.here / output
        for file in [place] if place.is_file() else place.rglob("*.npz"):  # in a new folder
            arrays = np.load(file)
            assert all(np.isfinite(arrays[each]).all() for each in arrays), f"predicted no numbers: {story}"

    def _check_sentence(self, command: list[str], ended: Ended, story: str) -> None:
        if ended.status == 2:  # of the parser of the command line
            assert "For full helptext" in ended.said, f"no sentence: {story}"
            return
        if command[0] == "check":  # its sentences are on stdout
            return
        said = [line for line in ended.said.splitlines() if line.startswith("bisplat: ")]
        refusals = [line for line in said if not line.startswith("bisplat: warning: ")]
        assert refusals and ended.said.splitlines()[-1] == refusals[-1], f"no sentence: {story}"
        assert len(refusals[-1]) < 1000, f"a long sentence: {story}"
