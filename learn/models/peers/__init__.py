"""The models of other authors, written from their papers and settings: NeRF², SwiftWRF, WRF-GS+ and GSRF."""
