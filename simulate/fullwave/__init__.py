"""Full wave: the field of every array element in the transmitter's region, by finite differences in time (FDTD).

By reciprocity the response of an element to a transmitter is the field that the element, as a source, produces at the
transmitter. So one solver run for each element gives the responses at every position of the region:
scene -> slabs and conductors -> materials of the cells -> solver -> stored field -> responses.
"""

OURS = "bisplat"  # Name of our own solver
