"""The methods that predict a quantity: their table, and those that interpolate any quantity."""
