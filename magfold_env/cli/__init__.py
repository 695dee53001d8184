"""The command line: `app`, and one module a command."""
