"""Reproduction of the paper: each of its figures and tables beside the results of this project."""
