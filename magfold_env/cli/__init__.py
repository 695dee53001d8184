"""The command line: `app`, and one module per command."""
