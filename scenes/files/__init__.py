"""Read what a user gives, and write what a command makes: safely, with errors of one sentence."""
