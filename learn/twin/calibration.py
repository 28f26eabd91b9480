"""What a calibration found: the corrected scene, the report on what was corrected by how much, and its files."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float, Inexact

from learn.twin.described_gateways import alone
from learn.twin.power_residual import PowerFit
from learn.twin.response_residual import ResponseFit
from scenes.files.atomic import write_atomically
from scenes.files.json_yaml_xml import PlainDumper, plain_values
from scenes.scene.antennas import Gateway
from scenes.scene.description import Scene
from scenes.scene.shapes import bounding_box
from scenes.scene.unknowns import OF_MATERIALS, Unknown
from scenes.storage.scene_writing import write_scene
from simulate.positions.positions import check_points
from simulate.rays.core.propagation import Propagation
from simulate.rays.tracer import Tracer

RECORD, GATEWAYS = "calibration.json", "gateways.yml"

UNIT = "metres, radians, or the logarithm of a ratio"


@dataclass(frozen=True)
class Calibration:
    """A corrected scene, and how certain its n corrections are.

    Attributes:
        scene: the corrected scene. After a calibration by received powers, its own gateways are those of the
            description.
        gateways: the G gateways that received the powers, at their corrected places, by name; of spectra none, since
            their gateway is the scene's.
        which: what may have been wrong: n numbers, each with a ``label`` for a reader and its ``tolerance``.
        values: [n] the corrections: metres, radians, or the logarithm of a ratio.
        deviations: [n] their standard deviations after the measurements were seen, in the same units.
        misfit: how badly the corrected scene explains the measurements, and the same of the scene as described. Of
            spectra the share of the measured power, 0…1, that is not explained; of received powers the median
            absolute error, dB.
        fit: what was measured beside the corrected scene. Of spectra it has the ``gain``, the common complex gain of
            the measured responses over the traced ones; of received powers the ``levels``, [G] dBm, which are added to
            traced path gains: transmit power and gains that the scene does not state.
        propagation: the mechanisms that rays followed.
    """

    scene: Scene
    gateways: dict[str, Gateway]
    which: list[Unknown]
    values: Float[np.ndarray, " n"]
    deviations: Float[np.ndarray, " n"]
    misfit: tuple[float, float]
    fit: ResponseFit | PowerFit = field(repr=False)
    propagation: Propagation = Propagation()

    def predict(self, positions: Float[np.ndarray, "K 3"]) -> Inexact[np.ndarray, "K M"]:
        """Predict by rays in the corrected scene what was measured: received powers, or element responses.

        A deep fade of traced powers is not as deep here, since what the scene lacks fills it.

        Args:
            positions: transmitter positions, metres, world frame, [K, 3].

        Returns:
            Expected powers, dBm, [K, G]; or complex responses at the carrier in the gain of the measured ones,
            [K, elements].

        Raises:
            ParameterError: the positions are not finite points.
        """
        positions = check_points(positions)
        return self.fit.predicted(self.tracers(bounding_box(positions), self.propagation), positions)

    def tracers(self, region: Float[np.ndarray, "2 3"], propagation: Propagation) -> list[Tracer]:
        """Tracers of the corrected scene with each gateway alone, for transmitters in a box."""
        scenes = list(alone(self.scene, self.gateways).values()) or [self.scene]
        return [Tracer(each, propagation, region) for each in scenes]

    def sentence(self) -> str:
        """How well the scene explains the measurements before and after."""
        now, before = self.misfit
        if isinstance(self.fit, PowerFit):
            return f"median error of the received powers: {before:.2f} dB before, {now:.2f} dB after"
        return f"unexplained share of the measured power: {before:.1%} before, {now:.1%} after"

    def rows(self) -> list[dict[str, str]]:
        """A table of what was changed and by how much, with standard deviations before and after."""
        rows = []
        for unknown, value, deviation in zip(self.which, self.values, self.deviations, strict=True):
            changed, sure = in_units(unknown, float(value), float(deviation))
            before = in_units(unknown, 0.0, unknown.tolerance)[1]
            rows.append({"what": unknown.label, "changed by": changed, "±": sure, "± before": before})
        return rows


def in_units(unknown: Unknown, value: float, deviation: float) -> tuple[str, str]:
    """A change and its standard deviation in millimetres, degrees or per cent, for a reader."""
    if unknown.kind in ("position", "object"):
        return f"{1e3 * value:+.1f} mm", f"{1e3 * deviation:.1f} mm"
    if unknown.kind == "rotation":
        return f"{np.degrees(value):+.2f}°", f"{np.degrees(deviation):.2f}°"
    digits = 1 if unknown.kind in OF_MATERIALS else 4
    return f"{100 * np.expm1(value):+.{digits}f} %", f"{100 * deviation:.{digits}f} %"


def write_calibration(found: Calibration, folder: Path) -> None:
    """Write the corrected scene and calibration.json to a folder, and gateways.yml if powers were received."""
    write_scene(found.scene, folder)
    if found.gateways:
        keys = ("position", "orientation", "pattern", "polarization")
        gateways = {name: {key: getattr(each, key) for key in keys} for name, each in found.gateways.items()}
        text = yaml.dump(plain_values(gateways), Dumper=PlainDumper, allow_unicode=True, sort_keys=False)
        write_atomically(folder / GATEWAYS, text.encode())
    numbers = zip(found.which, found.values.tolist(), found.deviations.tolist(), strict=True)
    changes = [
        {"what": each.label, "kind": each.kind, "change": value, "deviation": sure, "tolerance": each.tolerance}
        for each, value, sure in numbers
    ]
    misfit = {"described": found.misfit[1], "corrected": found.misfit[0]}
    content: dict[str, Any] = {"changes": changes, "unit": UNIT}
    if isinstance(found.fit, PowerFit):
        levels = dict(zip(found.gateways, found.fit.levels.tolist(), strict=True))
        content |= {"median_error_db": misfit, "levels_dbm": levels}
    else:
        content |= {"unexplained_power": misfit, "gain": [found.fit.gain.real, found.fit.gain.imag]}
    write_atomically(folder / RECORD, (json.dumps(content, indent=2) + "\n").encode())
