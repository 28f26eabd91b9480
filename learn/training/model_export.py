"""Export of a trained model to one file that other programs can run: from transmitter positions to spectra."""

from __future__ import annotations

import copy
import logging
import warnings
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor
from torch._higher_order_ops.scan import scan  # a private module, but the only loop that torch exports to ONNX
from torch.export import ExportedProgram, save

from learn.models.capabilities import TracesRays
from learn.training.run_folder import SpectrumRun
from scenes.files.atomic import write_atomically
from scenes.files.errors import InputError
from scenes.files.optional_packages import require_extra

INPUT, OUTPUT = "positions", "spectra"
"""Names of the input and output in an ONNX file.

The input is float32 [batch, 3], metres, in the dataset's world frame; the output is float32 [batch, 90, 360], 0…1.
"""


def export_model(run: SpectrumRun, path: Path, form: str) -> None:
    """Export a run's model to one file, as ``export`` explains it. The model of ``run`` itself is not changed."""
    writers: dict[str, Callable[[ExportedProgram], bytes]] = {"onnx": _onnx, "pt2": _pt2}
    if isinstance(run.model, TracesRays):
        raise InputError(
            f"{run.folder}: expected a model that needs no ray tracer, found {run.config.model}, which does"
        )
    if form == "onnx":
        require_extra("onnx", "export to ONNX")
    batch = {0: torch.export.Dim("batch")}
    model: Any = copy.deepcopy(run.model).cpu()
    for part in model.modules():
        if hasattr(part, "solve"):  # ONNX has no operator that solves linear equations
            part.solve = solve_by_elimination
    for name in ("torch.onnx", "torch._export.serde.serialize", "onnxscript", "onnx_ir"):
        logging.getLogger(name).setLevel(logging.ERROR)  # their messages about the model's operators help no user
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            program = torch.export.export(model, (torch.zeros(2, 3),), dynamic_shapes=(batch,))
        except torch._dynamo.exc.UserError as error:
            raise InputError(
                f"{run.config.model}: expected a model of any number of positions, found one that fixes it; write "
                f"positions.shape[0] instead of len(positions) ({str(error).splitlines()[0]})"
            ) from error
        content = writers[form](program)
    write_atomically(path, content)


def solve_by_elimination(matrix: Float[Tensor, "B N N"], right: Float[Tensor, "B N M"]) -> Float[Tensor, "B N M"]:
    """Solve linear equations by Gauss-Jordan elimination."""

    size = matrix.shape[-1]

    def eliminate(rows: Tensor, unit: Tensor) -> tuple[Tensor, Tensor]:
        pivot = (rows * unit[:, None]).sum(dim=1, keepdim=True)
        column = (rows[..., :size] * unit).sum(dim=-1, keepdim=True)
        pivot = pivot / (pivot[..., :size] * unit).sum(dim=-1, keepdim=True)
        return torch.where(unit[:, None] > 0, pivot, rows - column * pivot), unit.sum()

    rows = torch.cat([matrix, right], dim=-1)
    return scan(eliminate, rows, torch.eye(size, device=matrix.device))[0][..., size:]


def _pt2(program: ExportedProgram) -> bytes:
    """Content of a .pt2 file. It is made in memory, since torch ends the process when the disk is full."""
    content = BytesIO()
    save(program, content)
    return content.getvalue()


def _onnx(program: ExportedProgram) -> bytes:
    """Content of an .onnx file."""
    from onnxscript import opset18

    op: Any = opset18

    def stable_sort(values, stable=True, dim=-1, descending=False):
        # TopK puts the lower index first among equal values, so it is stable.
        return op.TopK(values, op.Shape(values), axis=dim, largest=0, sorted=1)

    def cumulative_product(values, dim, dtype=None):
        # The factors are transmittances 1 − α ≥ 0, and the product is e^{Σ ln(1 − α)}; ln 0 = −∞ correctly gives 0.
        return op.Exp(op.CumSum(op.Log(values), op.Constant(value_int=dim)))

    exported = torch.onnx.export(
        program,
        input_names=[INPUT],
        output_names=[OUTPUT],
        dynamo=True,
        verbose=False,
        # Operators that are missing in PyTorch's own table of ONNX operators.
        custom_translation_table={
            torch.ops.aten.sort.stable: stable_sort,
            torch.ops.aten.cumprod.default: cumulative_product,
        },
    )
    assert exported is not None
    return exported.model_proto.SerializeToString()
