"""How good and how fast models are."""
