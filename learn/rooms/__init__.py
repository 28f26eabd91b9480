"""Methods that predict spectra in rooms that they were not trained in, and the comparison of them."""
