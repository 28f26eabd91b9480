"""Where a transmitter is, from its spectrum: the position at which a trained field predicts that spectrum."""
