"""Read the user's files and write the results of commands: safely, with errors of one sentence."""
