"""The language server: `dsl.language_service` over the Language Server Protocol."""
