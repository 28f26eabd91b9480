"""Predictors without training, beside which every model is scored, and the array's ceiling."""
