"""The models: from a transmitter position to a spectrum, or to element responses."""
