"""The verbs of the command line, one module for a verb or a few that are alike."""
