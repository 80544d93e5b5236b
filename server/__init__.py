"""The services: rendering over HTTP, and the language server."""
