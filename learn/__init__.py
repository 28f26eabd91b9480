"""Models of spectra: trained, evaluated, compared and used."""

import os

# Torch's threads wait for each other in a loop of so many turns before they sleep. By its own default they turn for
# milliseconds: while another program uses one of two cores, a step of bisplat then takes 2 s instead of 0.2 s. Torch
# reads this when it is imported. A value that the user has set is kept.
os.environ.setdefault("GOMP_SPINCOUNT", "3000")
