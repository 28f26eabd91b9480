"""The table of models, and the way from a dataset and a model to a run folder with weights, resumable."""
