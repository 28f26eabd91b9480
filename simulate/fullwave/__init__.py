"""Full wave: the field of every array element in the transmitter's region, by finite differences in time (FDTD).

By reciprocity the response of an element to a transmitter is the field that the element, as a source, makes at the
transmitter. One run of a solver per element therefore gives the responses to every position of the region:
scene -> slabs and conductors -> materials of the cells -> solver -> stored field -> responses.
"""

OURS = "bisplat"
"""Name of our own solver."""
