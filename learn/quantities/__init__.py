"""The quantities that are measured and predicted: spectra, responses over a band, received powers, channels."""
