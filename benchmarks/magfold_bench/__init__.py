"""Measurements that the documentation quotes, each of which a command can repeat."""
