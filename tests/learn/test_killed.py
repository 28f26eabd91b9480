"""A training or a comparison that is killed with signal 9 at random moments ends as one that is not."""

import json
from pathlib import Path

import numpy as np
import pytest

from learn.comparison.results_folder import Results, row_name, run_folder
from scenes.files.output_folder import LOCK
from tests.folders import contents
from tests.killing import finish, kill_and_finish, moments

pytestmark = pytest.mark.kill

TRAIN = """
import sys
import torch
import bisplat
from learn.training import train
from learn.training import validation_part as epochs
torch.set_num_threads(1)
epochs.STEPS_PER_VALIDATION = 6
print("ready", flush=True)
options = {"primitives": 40, "width": 16}
bisplat.train(sys.argv[1], sys.argv[2], model="bisplat-aperture", options=options, steps=30, batch_size=5)
"""

COMPARE = """
import sys
import torch
import bisplat
from learn.comparison import variants
from learn.training.registry import MODELS
from learn.training import train
from learn.training import validation_part as epochs
torch.set_num_threads(1)
epochs.STEPS_PER_VALIDATION = 6
variants.APERTURE = {"with TX-PE": {"encoding": "octaves"}, "width 8": {"width": 8}}
MODELS["bisplat-aperture"].options.update(primitives=40, width=16)
print("ready", flush=True)
bisplat.compare(sys.argv[1], bisplat.variants(["bisplat-aperture"]), steps=12, output=sys.argv[2])
"""


Outcome = tuple[dict[str, bytes], list[float]]
"""Files that have to be the same, and scores, which may differ in their last digits: the arithmetic of a processor
depends on where in memory an array lies."""


def trained(folder: Path) -> Outcome:
    """Of a run, without its logs, its checkpoints, and the seconds it took."""
    kept = {name: content for name, content in contents(folder).items() if not name.startswith(("logs", "checkpoints"))}
    record = json.loads(kept.pop("training.json"))
    return kept, [record["steps"], record["validation_ssim"]]


def compared(folder: Path) -> Outcome:
    """Of a comparison: its settings, the scores of every spectrum, and its runs."""
    rows = [row for row in Results(folder).rows if row.get("steps")]
    assert len(rows) == 3
    files = {"protocol.json": (folder / "protocol.json").read_bytes()}
    scores = [row["ssim_median"] for row in rows]
    for row in rows:
        of_run, of_validation = trained(folder / run_folder(row))
        files |= {f"{row['label']}/{file}": content for file, content in of_run.items()}
        scores += of_validation + np.load(folder / "per_sample" / f"{row_name(row)}.npz")["ssim"].tolist()
    return files, scores


@pytest.mark.parametrize(("code", "outcome"), [(TRAIN, trained), (COMPARE, compared)], ids=["train", "compare"])
def test_killed_and_run_again_it_ends_with_the_same_weights_and_scores(code, outcome, tiny, tmp_path):
    seconds = finish(code, tiny, tmp_path / "whole")
    kill_and_finish(code, tiny, tmp_path / "killed", after=moments(1, seconds))
    (files, scores), (expected_files, expected_scores) = outcome(tmp_path / "killed"), outcome(tmp_path / "whole")
    assert files == expected_files
    assert scores == pytest.approx(expected_scores, abs=1e-5)
    assert not list(tmp_path.rglob("*.tmp")) and not list(tmp_path.rglob(LOCK))
