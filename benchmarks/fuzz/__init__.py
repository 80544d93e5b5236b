"""Random programs and damaged files against every reader of the language and of the IR."""
