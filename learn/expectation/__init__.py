"""How densely the known positions lie, and what score to expect from that."""
