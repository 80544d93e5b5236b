"""One module per command: `configure(parser)` declares its arguments, `run(arguments)` does it."""
