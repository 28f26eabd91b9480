"""Methods that predict the downlink's channels (CSI) from the uplink's, their scores, and the table of them."""
