"""Export of a simulated dataset as a scenario of DeepMIMO 4 [alkhateeb2019]."""
