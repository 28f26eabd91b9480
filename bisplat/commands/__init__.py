"""The command line: one function for each command, and the demo."""
