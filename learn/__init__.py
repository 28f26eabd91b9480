"""Models of spectra: trained, evaluated, compared and used."""

import os
import sys

# Torch's threads spin for this many turns while they wait for each other, and then sleep. By default they spin for
# milliseconds. If another program uses one of two cores, a training step of bisplat then takes 2 s instead of 0.2 s.
# Torch reads this variable when it is imported. A value that the user has set is kept.
os.environ.setdefault("GOMP_SPINCOUNT", "3000")


def _use_one_thread() -> None:
    """Let torch work in a forked process: it would wait there forever for threads that the fork did not copy."""
    torch = sys.modules.get("torch")
    if torch is not None:
        torch.set_num_threads(1)


os.register_at_fork(after_in_child=_use_one_thread)
