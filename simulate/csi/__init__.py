"""Datasets of channels over subcarriers (CSI): the folder that NeRF² calls MIMO, read and described."""
