"""The greedy choice is the one that an exhaustive search makes in each step, and its variances are those of kriging."""

import numpy as np
import pytest

from learn.planning.greedy import OpenField, choose


def random_covariance(size: int, seed: int, imaginary: bool = True) -> np.ndarray:
    """Of a field that is a sum of a few random modes, with a little noise at each candidate."""
    generator = np.random.default_rng(seed)
    modes = generator.normal(size=(size, 6)) + 1j * imaginary * generator.normal(size=(size, 6))
    covariance = modes @ modes.conj().T / 6 + 0.1 * np.eye(size)
    return covariance if imaginary else covariance.real


def kriging_variance(covariance: np.ndarray, nugget: float, measured: list[int]) -> float:
    """Mean over the candidates, from the equations of kriging."""
    across = covariance[measured]
    matrix = across[:, measured] + nugget * np.eye(len(measured))
    explained = across.conj().T @ np.linalg.solve(matrix, across)
    return float((covariance - explained).diagonal().real.mean())


@pytest.mark.parametrize("imaginary", [False, True], ids=["real", "complex"])
def test_every_step_is_the_best_of_all(imaginary):
    fields = [
        OpenField(random_covariance(25, 1, imaginary), nugget=0.05),
        OpenField(0.3 * random_covariance(25, 2, imaginary), nugget=0.15),
    ]

    def variance(measured: list[int]) -> float:
        return sum(kriging_variance(each.covariance, each.nugget, measured) for each in fields)

    chosen, left = choose(fields, 8)
    assert left[0] == pytest.approx(variance([]))
    for step in range(8):
        before = chosen[:step].tolist()
        others = [each for each in range(25) if each not in before]
        assert chosen[step] == min(others, key=lambda each: variance([*before, each]))
        assert left[step + 1] == pytest.approx(variance(chosen[: step + 1].tolist()))


def test_all_candidates_are_chosen_once_also_where_nothing_is_left_to_learn():
    chosen, left = choose([OpenField(np.ones((6, 6)), nugget=1e-9)], 6)
    assert sorted(chosen) == list(range(6))
    assert np.abs(left[1:]).max() < 1e-6
