"""A run folder: everything that is needed to use a trained model.

config.json          settings, the model's ``options``, the settings ``by_steps`` of training, array, grid, versions
split.json           names of the training, validation and test spectra
weights.safetensors  weights of the best checkpoint; the training is finished if this file exists
training.json        steps, seconds, device, date, validation SSIM, how far predictions are off
known_positions.csv  positions of the spectra that the model learned from, metres
checkpoints/         last.ckpt and previous.ckpt, from which a training resumes (``learn.training.lightning_trainer``)
logs/                CSV and TensorBoard
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from safetensors import SafetensorError
from safetensors.torch import load_file, save

from learn.data.splits import Split, read_split
from learn.models.base import SpectrumModel
from learn.training.config import Config, read_config, require_same_spectra
from learn.training.conformal_deviation import Deviation, nearest_known, reach
from learn.training.prediction import DType, Prediction, checked_dtype, predicted, uncertainty
from learn.training.registry import model_entry
from learn.training.run_files import build_model, read_known_positions, read_training
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError, ParameterError, cut, require_instance, require_path, shown
from scenes.files.input_file import MEGABYTE, require_regular
from scenes.files.plain_text import say
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import read_dataset
from simulate.dataset.dataset_frequency import several_frequencies
from simulate.dataset.picture_files import what_is_at
from simulate.positions.positions import check_points
from simulate.spectra.beamformer import Beamformer

LARGEST_WEIGHTS = 40_000 * MEGABYTE
"""Largest size of weights.safetensors, bytes; kriging of spectra keeps 32 kB of each known picture."""


@dataclass(frozen=True)
class Run:
    """A trained model or a fitted method with its settings, as ``train`` and ``load_run`` return it.

    A run of spectra is a ``SpectrumRun``, one of any other quantity a ``MethodRun``. Both have ``predict``.

    Attributes:
        folder: the run folder.
        config: settings of the run.
        dataset_sha256: fingerprint of the dataset that it was trained on.
        frequency: of the dataset, Hz.

    Example:
        >>> import bisplat
        >>> run = bisplat.load_run("runs/lab")
        >>> run.name, run.config.model
        ('lab', 'helmholtz')
        >>> run
        Run('runs/lab': helmholtz, split files, seed 0)
    """

    folder: Path
    config: Config
    dataset_sha256: str
    frequency: float

    def __repr__(self) -> str:
        return f"Run({str(self.folder)!r}: {self.config.model}, split {self.config.split}, seed {self.config.seed})"

    @property
    def name(self) -> str:
        """Name of the run folder without its parents, for tables and pages."""
        return self.folder.resolve().name

    def predict(self, *args: Any, **options: Any) -> Any:
        """Predict what was learned, as ``SpectrumRun`` and ``MethodRun`` explain it."""
        raise NotImplementedError

    def dataset(self) -> Dataset:
        """Read the dataset of this run from the folder in which it was at the training.

        Raises:
            InputError: the folder no longer exists, is not a valid dataset, or holds other spectra now.

        Example:
            >>> import bisplat
            >>> bisplat.load_run("runs/lab").dataset().positions.shape
            (40, 3)
        """
        folder = Path(self.config.dataset)
        if not folder.is_dir():
            raise InputError(
                f"{folder}: expected the dataset that {self.folder} was trained on, found {what_is_at(folder)}; if it "
                f'has moved, write its new place as "dataset" in {self.folder / "config.json"}'
            )
        found = read_dataset(folder, self.frequency if several_frequencies(folder) else None)
        require_same_spectra(found, self.folder, self.dataset_sha256)
        return found

    def is_trained_on(self, dataset: Dataset) -> bool:
        """Whether a dataset is that of this run, in whatever folder it is now.

        Args:
            dataset: any dataset.

        Example:
            >>> import bisplat
            >>> bisplat.load_run("runs/lab").is_trained_on(bisplat.read_dataset("data/lab"))
            True
        """
        require_instance(Dataset, dataset=dataset)
        return dataset.fingerprint == self.dataset_sha256

    def split(self, dataset: Dataset) -> Split:
        """Read which spectra this run was trained, validated and tested on.

        Args:
            dataset: the dataset of this run.

        Returns:
            Indices into the dataset.

        Raises:
            InputError: the dataset lacks some of these spectra, or split.json is damaged.

        Example:
            >>> import bisplat
            >>> run = bisplat.load_run("runs/lab")
            >>> parts = run.split(run.dataset())
            >>> len(parts.train), len(parts.validation), len(parts.test)
            (29, 3, 8)
        """
        require_instance(Dataset, dataset=dataset)
        return read_split(self.folder / "split.json", dataset.names, dataset.folder)


@dataclass(frozen=True, repr=False)
class SpectrumRun(Run):
    """A trained model of spectra.

    Attributes:
        beamformer: the dataset's array and grid.
        model: the trained model, in evaluation mode, on the GPU if there is one.

    Example:
        >>> import bisplat
        >>> run = bisplat.load_run("runs/lab")
        >>> prediction = run.predict([[2.5, 3.0, 1.2], [2.6, 3.0, 1.2]])  # metres
        >>> prediction.spectra.shape
        (2, 90, 360)
    """

    beamformer: Beamformer
    model: SpectrumModel

    def predict(self, positions: Float[np.ndarray, "K 3"], dtype: DType = "float32") -> Prediction:
        """Predict spectra, and element responses if the model predicts them.

        Args:
            positions: [K, 3] transmitter positions, metres, in the world frame of the run's dataset.
            dtype: numbers of the spectra, as NumPy names them: "float32", 0…1, or "uint8", grey levels 0…255, as the
                pictures of a dataset are. Grey levels need a quarter of the memory.

        Returns:
            Spectra [K, 90, 360], responses [K, elements] or None, and responses over the band or None.

        Raises:
            ParameterError: the positions do not have the shape [K, 3], or are not finite numbers; or ``dtype`` is
                another type.
            InputError: the model predicts values that are not finite, as one with absurd weights does.

        Example:
            >>> import bisplat
            >>> run = bisplat.load_run("runs/lab")
            >>> prediction = run.predict([[2.5, 3.0, 1.2]])
            >>> prediction.spectra.shape, bool(prediction.spectra.max() <= 1)
            ((1, 90, 360), True)
            >>> run.predict([[2.5, 3.0, 1.2]], dtype="uint8").spectra.dtype
            dtype('uint8')
        """
        prediction, finite = predicted(self.model, check_points(positions), checked_dtype(dtype))
        if not finite.all():
            raise InputError(
                f"{self.folder}: expected a model that predicts finite spectra, found values that are not finite at "
                f"{int((~finite).sum())} of {len(finite)} positions"
            )
        return prediction

    def deviation(self, positions: Float[np.ndarray, "K 3"]) -> Float[np.ndarray, " K"] | None:
        """State how far predicted spectra may be off.

        About 90 % of the errors lie within 1.645 of these standard deviations. The deviation grows with the distance
        to the known positions, up to that of knowing nothing; for models that compute a variance of their own, such as
        kriging, it grows with this variance. Known spectra that are predicted from those farther away tell by how much,
        and validation spectra set the scale (documentation, How sure a prediction is).

        Args:
            positions: [K, 3] transmitter positions, metres, in the world frame of the run's dataset.

        Returns:
            [K] standard deviation of the values of each spectrum, 0…1. It is nan, with a warning, at positions that are
            farther from all known ones than these are from one another. None: the run had fewer than 10 validation
            spectra.

        Raises:
            ParameterError: the positions do not have the shape [K, 3], or are not finite numbers.
            InputError: training.json is damaged.

        Example:
            >>> import bisplat
            >>> bisplat.load_run("runs/lab").deviation([[2.5, 3.0, 1.2]]) is None  # it has 3 validation spectra
            True
        """
        points, found = check_points(positions), read_training(self.folder).deviation
        return None if found is None else stated_deviation(self, found, points)


def stated_deviation(
    run: SpectrumRun, deviation: Deviation, points: Float[np.ndarray, "K 3"]
) -> Float[np.ndarray, " K"]:
    """The standard deviations at positions, nan where nothing is known."""
    known, wavelength = read_known_positions(run.folder), float(run.model.wavelength)
    distance, farthest = nearest_known(known, points, wavelength), reach(known, wavelength)
    gap = distance if deviation.over == "distance" else uncertainty(run.model, points)
    beyond = distance > farthest
    if beyond.any():
        say(
            f"warning: {run.folder}: {int(beyond.sum())} of {len(points)} positions are more than "
            f"{farthest * wavelength:.3g} m from everything that the run knows; how far predictions are off there "
            "is unknown, and the deviation is nan"
        )
    return np.where(beyond, np.nan, deviation.at(gap, len(points)))


def save_weights(folder: Path, model: SpectrumModel) -> None:
    """Write weights.safetensors."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()}
    write_atomically(folder / "weights.safetensors", save(tensors))


def load_weights(model: SpectrumModel, folder: Path) -> None:
    """Load the weights of a finished run into a model, which keeps its own region, wavelength and turn."""
    source, own = load_spectra(folder).model.state_dict(), model.state_dict()
    try:
        if source.keys() != own.keys():  # such as one field of a moving array, and responses of a fixed one
            raise RuntimeError("weights of other names")
        kept: dict[str, Any] = {name: own[name] for name in ("region", "wavelength", "turn") if name in own}
        model.load_state_dict({**source, **kept})
    except RuntimeError as error:
        raise InputError(
            f"{folder}: expected a run of the same model and size, found {cut(str(error).splitlines()[-1].strip())}"
        ) from error


def require_finished(folder: Path) -> Path:
    """The weights of a finished run."""
    path = folder / "weights.safetensors"
    if not path.exists():
        raise InputError(
            f"{folder}: expected a finished run, found no weights.safetensors; repeat the same bisplat train to finish "
            "it"
        )
    return path


def load_spectra(run: Run | Path | str) -> SpectrumRun:
    """The run of a model of spectra that a caller gives, or that is in a folder."""
    if isinstance(run, SpectrumRun):
        return run
    folder = run.folder if isinstance(run, Run) else run  # of another quantity: it is refused
    require_path(folder=folder)
    folder = Path(folder)
    config, beamformer, dataset_sha256, hertz = read_config(folder)
    path = require_finished(folder)
    try:
        model_entry(config.model)
    except ParameterError as error:  # the user's own model is imported again
        raise InputError(f"{folder / 'config.json'}: {error}") from error
    model = build_model(config, np.zeros((2, 3)), beamformer, 1.0)  # the weights have the region and the wavelength
    require_regular(path, f"the weights of {config.model}", LARGEST_WEIGHTS)
    try:
        weights = load_file(path)
        unreal = next((name for name, each in weights.items() if each.is_complex()), None)
        if unreal is not None:  # torch would drop the imaginary parts with a warning
            raise InputError(f"{path}: expected real weights of {config.model}, found complex ones in {shown(unreal)}")
        model.load_state_dict(weights)
    except (SafetensorError, RuntimeError, OSError) as error:
        found = cut(str(error).splitlines()[-1].strip())  # the first line of PyTorch's errors says nothing
        raise InputError(f"{path}: expected the weights of {config.model}, found {found}") from error
    wrong = next((name for name, each in model.state_dict().items() if not each.isfinite().all()), None)
    if wrong is not None:
        raise InputError(f"{path}: expected finite weights of {config.model}, found others in {wrong}")
    device = "cuda" if torch.cuda.is_available() else "cpu"
    return SpectrumRun(folder, config, dataset_sha256, hertz, beamformer, model.eval().to(device))
