"""Where to measure next: the positions that lower the open variance of the field most."""
