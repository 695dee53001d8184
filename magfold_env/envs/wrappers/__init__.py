"""Wrappers and adapters."""
