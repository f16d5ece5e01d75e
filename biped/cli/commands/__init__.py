"""Commands by what they are for, each a function of the parsed arguments: study, then show."""
