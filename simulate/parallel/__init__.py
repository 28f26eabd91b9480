"""What threads of one process share."""
