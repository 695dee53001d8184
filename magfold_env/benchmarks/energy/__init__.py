"""Measure the predictors by energy: what they cost, and how often they agree."""
