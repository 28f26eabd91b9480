"""How responses are simulated: each engine is one object, and a table lists them."""
