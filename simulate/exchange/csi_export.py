"""Export of responses over a band as the CSI folder of NeRF² and GSRF, whose task is the downlink from the uplink."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from scipy.spatial.transform import Rotation

from scenes.files.errors import InputError
from scenes.files.output_folder import new_folder
from scenes.files.plain_text import say
from simulate.dataset.channels_folder import OF_EACH, write_channels
from simulate.dataset.dataset import Dataset
from simulate.dataset.dataset_folder import given_dataset, require_fixed_array
from simulate.dataset.index_files import write_index
from simulate.dataset.metadata import made_here


def export_csi(dataset: Dataset | Path | str, folder: Path, force: bool = False) -> None:
    """Write the responses of a dataset over a band as a CSI folder, as ``export`` explains it."""
    dataset = given_dataset(dataset)
    if dataset.band is None:
        raise InputError(
            f"{dataset.folder}: expected responses over a band, found those of the carrier alone; simulate --bandwidth "
            "and --subcarriers make them"
        )
    require_fixed_array(dataset, "a base station that stands still")
    count = dataset.band.subcarriers
    if count % 2:
        raise InputError(f"{dataset.folder}: expected an even number of subcarriers, half of each link, found {count}")
    if count != 2 * OF_EACH:
        say(
            f"warning: {dataset.folder}: the loaders of NeRF² and GSRF take {OF_EACH} subcarriers for the uplink and "
            f"{OF_EACH} for the downlink, and the dataset has {count}; simulate --subcarriers {2 * OF_EACH}"
        )
    turned = Rotation.from_quat(dataset.gateway_orientation).apply(dataset.array.positions)
    elements = dataset.gateway_position + turned * dataset.wavelength
    with new_folder(folder, force) as unfinished:
        stated: dict[str, Any] = {**made_here(), "kind": "csi", "band": asdict(dataset.band)}
        if dataset.frequency.source != "assumed":
            stated["frequency_hz"] = dataset.frequency.hertz
        write_channels(unfinished, dataset.positions, elements, dataset.band_responses, stated)
        for name, part in (("train", dataset.train), ("test", dataset.test)):
            if len(part):
                write_index(unfinished / f"{name}_index.txt", part)
