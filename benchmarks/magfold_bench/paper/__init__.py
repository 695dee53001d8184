"""Reproduction of the paper: its figures and tables, compared with this project's results."""
