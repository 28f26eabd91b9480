"""How good a run is: on held-out spectra, against fresh simulation, and in locating transmitters."""
