"""Where a transmitter is, from its spectrum."""
