"""One module per command, each a function of the parsed arguments: study, then show."""
