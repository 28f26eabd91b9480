"""One function that writes a run, a dataset or a coverage map for other programs."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from learn.fitted.coverage import CoverageMap
from learn.training.run_folder import Run
from scenes.files.errors import ParameterError, require_flag, require_instance, require_path, require_word
from simulate.dataset.dataset import Dataset

if TYPE_CHECKING:
    from scenes.scene.description import Scene

Format = Literal["onnx", "pt2", "hdf5", "csi", "deepmimo", "map"]
"""What other programs read: a model as one file, a dataset as a file or a folder, a coverage map as a folder."""

SUFFIXES: dict[str, Format] = {".onnx": "onnx", ".pt2": "pt2", ".h5": "hdf5", ".hdf5": "hdf5"}


def export(
    source: Run | Dataset | CoverageMap | Path | str,
    output: Path | str,
    format: Format | None = None,
    *,
    scene: Scene | None = None,
    force: bool = False,
) -> None:
    """Write a run, a dataset or a coverage map for other programs.

    The formats, and what they are made of:

    - ``onnx`` and ``pt2``: the model of a run of spectra as ONNX or as a ``torch.export`` program. It maps "positions",
      float32 [batch, 3] in metres in the dataset's world frame, to "spectra", float32 [batch, 90, 360], 0…1. Models
      with primitives are exported with a plain renderer, whose memory grows with primitives × pixels.
    - ``hdf5``: a dataset of spectra or powers as one file, for example for MATLAB. An existing file is replaced.
    - ``csi``: responses over a band as the CSI folder that the loaders of NeRF² and GSRF read. The lower half of the
      band stands for the uplink, the upper half for the downlink.
    - ``deepmimo``: the paths of a dataset that was simulated by rays as a scenario folder of DeepMIMO 4
      [alkhateeb2019]. They are traced again, for one element of the gateway in the array's middle, which is DeepMIMO's
      transmitter. The folder's name becomes that of the scenario.
    - ``map``: a coverage map as ``coverage.npz``, ``coverage.png`` and ``.pdf``, and ``interval.png`` and ``.pdf``. In
      the arrays, row 0 is the south, the smallest y. Where the map says nothing, they have NaN.

    The documentation, Export to other programs, lists their arrays.

    Args:
        source: a run, a dataset, a coverage map, or the folder of a run or a dataset.
        output: the file or the folder to write. A folder must be new or empty.
        format: one of the above. None: that of the file's suffix, .onnx, .pt2 or .h5; and ``map`` for a map.
        scene: of a map: the scene whose section at the map's height is drawn. None: that of the dataset's folder.
        force: allow a folder that holds other files; files of the same names are replaced.

    Raises:
        InputError: the source cannot be written in this format, such as a model that traces rays, or a dataset without
            a band as ``csi``; or the folder holds other files.
        ParameterError: no format is stated, and the name of the output tells none.
        MissingExtraError: the packages for ONNX are not installed.
        OSError: the file cannot be written.

    Example:
        >>> import bisplat, h5py
        >>> bisplat.export("data/lab", "lab.h5")
        >>> with h5py.File("lab.h5") as file:
        ...     file["spectra"].shape, file["responses"].dtype, int(file.attrs["frequency_hz"])
        ((40, 90, 360), dtype('complex64'), 915000000)
        >>> bisplat.export(bisplat.load_run("runs/lab"), "lab.pt2")
        >>> bisplat.export("data/lab", "lab_paths", "deepmimo")
    """
    require_instance(Run, Dataset, CoverageMap, str, PathLike, source=source)
    require_path(output=output)
    require_flag(force=force)
    path = Path(output)
    if format is not None:
        require_word(get_args(Format), format=format)
    chosen = format or ("map" if isinstance(source, CoverageMap) else SUFFIXES.get(path.suffix.lower()))
    if chosen is None:
        raise ParameterError("format", f"expected one of {', '.join(get_args(Format))} for {path}, found none")
    if (chosen == "map") != isinstance(source, CoverageMap):
        raise ParameterError("source", f"expected a coverage map and the format map together, found {chosen}")
    if isinstance(source, CoverageMap):
        from learn.reports.coverage_report import write_coverage

        write_coverage(source, path, scene, force)
    elif chosen in ("onnx", "pt2"):
        from learn.training.model_export import export_model
        from learn.training.run_folder import load_spectra

        require_instance(Run, str, PathLike, source=source)
        assert not isinstance(source, Dataset)
        export_model(load_spectra(source), path, chosen)
    else:
        require_instance(Dataset, str, PathLike, source=source)
        assert not isinstance(source, Run)
        if chosen == "hdf5":
            from simulate.exchange.hdf5_export import export_hdf5

            export_hdf5(source, path)
        elif chosen == "csi":
            from simulate.exchange.csi_export import export_csi

            export_csi(source, path, force)
        else:
            from simulate.exchange.deepmimo_export import export_deepmimo

            export_deepmimo(source, path, force)
