"""What measured and simulated spectra hold: grids, distances, phases, limits."""
