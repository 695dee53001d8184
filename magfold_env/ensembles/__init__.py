"""Ensembles: many perturbed releases of a scene, and the probabilities of where they end."""

from magfold_env.ensembles.releases import PREDICTORS, ensemble, predictions, release
from magfold_env.ensembles.result import Bar, Ensemble, Run, bars, generator

__all__ = [
    "PREDICTORS",
    "Bar",
    "Ensemble",
    "Run",
    "bars",
    "ensemble",
    "generator",
    "predictions",
    "release",
]
