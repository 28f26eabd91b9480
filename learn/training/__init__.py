"""The table of models, and resumable training of a model on a dataset into a run folder."""
