"""The array's ceiling: how well any set of element responses can reproduce a picture.

An array of MN elements can only ever show |A y|. The best y for each test picture bounds what a model that respects
the array can score, and tells how much of a measured picture is not spatial spectrum at all.
"""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float

from simulate.spectrum import PlanarArray, normalise

STARTS, STEPS, LEARNING_RATE = 4, 200, 0.05
EVERY_DEG = 5
"""The fit looks at every fifth row and column: a 4 × 4 array resolves nothing finer."""


def array_ceiling(truth: Float[np.ndarray, "K 90 360"], array: PlanarArray) -> Float[np.ndarray, "K 90 360"]:
    """Best pictures of the form normalise(|A y|), fitted to each true picture.

    min over y of Σ (normalise(|A y|) − truth)², by Adam from four random starts each (the problem is not convex).
    """
    steering = torch.from_numpy(array.steering[::EVERY_DEG, ::EVERY_DEG].reshape(-1, array.elements))
    steering = steering.to(torch.complex64)
    wanted = torch.from_numpy(np.ascontiguousarray(truth[:, ::EVERY_DEG, ::EVERY_DEG])).float().flatten(1)
    generator = torch.Generator().manual_seed(0)
    y = torch.randn(STARTS, len(truth), array.elements, dtype=torch.complex64, generator=generator)
    y.requires_grad_(True)
    optimiser = torch.optim.Adam([y], lr=LEARNING_RATE)
    for _ in range(STEPS):
        spectrum = (y @ steering.T).abs()
        low = spectrum.amin(-1, keepdim=True)
        error = ((spectrum - low) / (spectrum.amax(-1, keepdim=True) - low) - wanted).square().mean(-1)
        optimiser.zero_grad()
        error.sum().backward()
        optimiser.step()
    best = error.argmin(dim=0)
    chosen = y.detach()[best, torch.arange(len(truth))].numpy()
    return np.concatenate([normalise(array.spectrum(part)) for part in np.array_split(chosen, 1 + len(chosen) // 64)])
