"""Methods that predict responses over a band at new positions, their scores, and the table of them."""
