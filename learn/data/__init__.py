"""Which spectra are for training, validation and test, and how predictions of them are scored."""
