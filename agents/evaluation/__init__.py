"""Policies at play: methods, episodes, statistics, pictures and pages."""
