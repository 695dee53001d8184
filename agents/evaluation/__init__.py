"""Evaluation of policies: methods, episodes, statistics, pictures and pages."""
