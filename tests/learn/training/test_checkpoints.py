"""Checkpoints run no code, are written whole, and a damaged one is no loss."""

import errno
import os
import pickle
import shutil
import sys
from io import BytesIO
from pathlib import Path

import pytest
import torch

from learn.training.lightning_trainer import LAST, PREVIOUS, read_checkpoint
from learn.training.train import train_run
from scenes.files import atomic
from scenes.files.errors import InputError

pytestmark = pytest.mark.usefixtures("small_models")


class Payload:
    """Its unpickling makes a file."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.fixture
def stopped(tmp_path, finished_run):
    """A run whose weights are still to be written: it has both checkpoints."""
    folder = shutil.copytree(finished_run, tmp_path / "run")
    (folder / "weights.safetensors").unlink()
    return folder


def weights(folder: Path) -> bytes:
    return (folder / "weights.safetensors").read_bytes()


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 255
    path.write_bytes(content)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def zero(path: Path) -> None:
    path.write_bytes(bytes(5000))


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def foreign(path: Path) -> None:
    """As another program writes it."""
    torch.save({"state_dict": {}, "global_step": 6}, path)


FAULTS = pytest.mark.parametrize("fault", [cut, flip, empty, zero, pipe, foreign], ids=lambda fault: fault.__name__)


@FAULTS
def test_training_goes_on_from_the_checkpoint_before_a_damaged_one(stopped, tiny_config, finished_run, capsys, fault):
    fault(stopped / "checkpoints" / LAST)
    train_run(tiny_config, stopped)
    assert weights(stopped) == weights(finished_run)
    (sentence,) = [line for line in capsys.readouterr().err.splitlines() if "expected a checkpoint" in line]
    assert sentence.startswith(f"bisplat: {stopped / 'checkpoints' / LAST}: ")
    assert sentence.endswith("training resumes from the checkpoint before it, previous.ckpt")
    for name in (LAST, PREVIOUS):
        read_checkpoint(stopped / "checkpoints" / name)


def test_a_missing_last_checkpoint_is_no_fault(stopped, tiny_config, finished_run, capsys):
    (stopped / "checkpoints" / LAST).unlink()  # killed between the two renames
    train_run(tiny_config, stopped)
    assert weights(stopped) == weights(finished_run)
    assert "expected a checkpoint" not in capsys.readouterr().err


@FAULTS
def test_two_damaged_checkpoints_are_one_sentence_and_stay(stopped, tiny_config, fault):
    for name in (LAST, PREVIOUS):
        fault(stopped / "checkpoints" / name)
    with pytest.raises(InputError, match=r"last\.ckpt: expected .*previous\.ckpt: expected .* train from the start"):
        train_run(tiny_config, stopped)
    assert {path.name for path in (stopped / "checkpoints").iterdir()} == {LAST, PREVIOUS}


@pytest.mark.parametrize("save", [torch.save, lambda content, path: path.write_bytes(pickle.dumps(content))])
def test_code_in_a_checkpoint_is_not_run(stopped, tiny_config, tmp_path, save):
    content = torch.load(stopped / "checkpoints" / LAST, weights_only=True)
    for name in (LAST, PREVIOUS):
        save({**content, "hello": Payload(tmp_path / "code-was-run")}, stopped / "checkpoints" / name)
    with pytest.raises(InputError, match="damaged, or that could run code when read"):
        train_run(tiny_config, stopped)
    assert not (tmp_path / "code-was-run").exists()
    loads = pickle.loads if save is not torch.save else lambda content: torch.load(BytesIO(content), weights_only=False)
    loads((stopped / "checkpoints" / LAST).read_bytes())
    assert (tmp_path / "code-was-run").exists(), "the payload must be a real one"


@pytest.mark.parametrize("key", ["state_dict", "best", "loops", "optimizer_states", "callbacks"])
@pytest.mark.parametrize("value", [3, [{}]], ids=["number", "list"])
def test_checkpoint_of_another_training_is_one_sentence(stopped, tiny_config, key, value):
    path = stopped / "checkpoints" / LAST
    torch.save({**torch.load(path, weights_only=True), key: value}, path)
    with pytest.raises(InputError) as error:
        train_run(tiny_config, stopped)
    assert str(error.value).startswith(
        f"{stopped / 'checkpoints'}: expected checkpoints of this training, found those of another one"
    )
    assert "\n" not in str(error.value)


@pytest.mark.skipif(sys.platform != "linux", reason="finds the file that is written in /proc")
def test_full_disk_names_the_checkpoint_and_keeps_the_one_before(tmp_path, tiny_config, finished_run, monkeypatch):
    folder, whole = tmp_path / "run", atomic.os.fsync

    def fsync(number):
        if "checkpoints" in os.readlink(f"/proc/self/fd/{number}") and (folder / "checkpoints" / PREVIOUS).exists():
            raise OSError(errno.ENOSPC, "No space left on device")
        whole(number)

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "fsync", fsync)
        with pytest.raises(OSError, match="No space left") as error:
            train_run(tiny_config, folder)
    assert error.value.filename == str(folder / "checkpoints" / LAST)
    assert [path.name for path in (folder / "checkpoints").iterdir()] == [PREVIOUS]
    train_run(tiny_config, folder)
    assert weights(folder) == weights(finished_run)


def test_best_weights_are_not_those_of_a_worse_validation(tmp_path, tiny_config, finished_run, monkeypatch):
    """The last checkpoint of a training that got worse still holds the better weights."""
    from lightning.pytorch import Trainer

    metrics = Trainer.callback_metrics
    scores = {6: torch.tensor(0.9), 12: torch.tensor(0.1)}
    patched = property(lambda self: {**metrics.fget(self), "validation_ssim": scores.get(self.global_step)})
    monkeypatch.setattr(Trainer, "callback_metrics", patched)
    folder = tmp_path / "run"
    train_run(tiny_config, folder)
    first, last = (read_checkpoint(folder / "checkpoints" / name) for name in (PREVIOUS, LAST))
    assert last["best"]["validation_ssim"] == pytest.approx(0.9)
    for name, value in last["best"]["weights"].items():
        assert torch.equal(value, first["state_dict"][name])
