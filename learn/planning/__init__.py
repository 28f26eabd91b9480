"""Planning of the next positions to measure."""
