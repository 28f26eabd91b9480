"""Datasets of received powers (RSSI): the folder that NeRF² calls BLE, read, written, simulated and described."""
