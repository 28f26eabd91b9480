"""What a look at a dataset folder finds, and the reading of the files that folders of every quantity have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from jaxtyping import Float
from msgspec import Meta

from scenes.files.errors import InputError, ParameterError
from simulate.dataset.dataset import Dataset
from simulate.dataset.metadata import band_of, read_metadata
from simulate.positions.positions import FARTHEST, points_digest, read_points
from simulate.spectra.band import Band

Coordinate = Annotated[float, Meta(ge=-FARTHEST, le=FARTHEST)]

Read = TypeVar("Read")  # What a file holds


@dataclass(frozen=True)
class Inspection:
    """What a look at a dataset folder has found so far."""

    folder: Path
    problems: list[str] = field(default_factory=list)  # a sentence for each error that makes the folder unusable
    warnings: list[str] = field(default_factory=list)  # a sentence for each oddity that does not
    dataset: Dataset | None = None  # the dataset; None if there are problems

    @property
    def valid(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def usable(self) -> Dataset:
        """The dataset."""
        if self.dataset is None:
            more = f" ({len(self.problems) - 1} more problems)" if len(self.problems) > 1 else ""
            raise InputError(self.problems[0] + more)
        return self.dataset

    def noting(self, otherwise: Read, read: Callable[..., Read], *arguments: Any) -> Read:
        """What a function reads; if it raises an InputError, the other value, and the sentence joins the problems."""
        try:
            return read(*arguments)
        except InputError as error:
            self.problems.append(str(error))
            return otherwise

    def positions(self) -> Float[np.ndarray, "K 3"] | None:
        """The rows of tx_pos.csv; None if they are a problem."""
        return self.noting(None, read_points, self.folder / "tx_pos.csv")

    def metadata(self) -> dict[str, Any]:
        """The content of metadata.json; empty if there is none, or a problem."""
        return self.noting({}, read_metadata, self.folder / "metadata.json")

    def band(self, metadata: dict[str, Any], hertz: float | None) -> Band | None:
        """The subcarriers that metadata.json states. A band too wide for a known frequency is a problem."""
        band = band_of(metadata)
        try:
            if band is not None and hertz is not None:
                band.frequencies(hertz)
        except ParameterError as error:
            self.problems.append(f"{self.folder / 'metadata.json'}: band.{error}")
        return band

    def note_changed_places(self, metadata: dict[str, Any], **rows: Float[np.ndarray, "K 3"] | None) -> None:
        """Note that the rows ``tx_pos`` or ``rx_pos`` are not those that the folder was simulated with."""
        made = {"tx_pos": metadata.get("positions_sha256"), "rx_pos": metadata.get("receivers_sha256")}
        frequencies = max(1, len(metadata.get("frequencies_hz", ())))
        found = {
            name: {points_digest(each) for each in np.array_split(points, frequencies)}
            for name, points in rows.items()
            if points is not None and made[name]
        }
        changed = [name for name, digests in found.items() if digests != {made[name]}]
        if len(changed) == 2 and found["tx_pos"] == {made["rx_pos"]}:
            exchanged = "tx_pos.csv and rx_pos.csv are exchanged"
            self.warnings.append(f"{exchanged}: metadata.json has the digest of each other's positions")
        elif changed:
            names = " and ".join(f"{name}.csv" for name in changed)
            digest = "metadata.json has the digest of other positions"
            self.warnings.append(f"{names} changed since the simulation: {digest}")
