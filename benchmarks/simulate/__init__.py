"""How fast and how true simulations are: rays, full wave, and one against the other."""
