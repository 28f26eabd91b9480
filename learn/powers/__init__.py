"""Methods that predict received powers (RSSI) at new positions, their scores, and the table that compares them."""
