"""From element responses to spectra and back: array, angular grid, beamformer, receiver errors, phase retrieval."""
