"""The twin: ray tracing of an approximate scene, corrected by measured spectra."""
