"""Models of spectra: trained, evaluated, compared and used."""

import os

# Torch's threads spin for this many turns while they wait for each other, and then sleep. By default they spin for
# milliseconds. If another program uses one of two cores, a training step of bisplat then takes 2 s instead of 0.2 s.
# Torch reads this variable when it is imported. A value that the user has set is kept.
os.environ.setdefault("GOMP_SPINCOUNT", "3000")
