"""The networks of the paper, BiSplat-WRF [zhang2026], our BiSplat-aperture, and plain networks of the position."""
