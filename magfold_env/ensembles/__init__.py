"""Ensembles: many perturbed releases of a scene, and the probabilities of where they end."""

from magfold_env.ensembles.many import ensemble
from magfold_env.ensembles.predictions import predictions
from magfold_env.ensembles.release import release
from magfold_env.ensembles.result import Ensemble
from magfold_env.ensembles.run import generator

__all__ = ["Ensemble", "ensemble", "generator", "predictions", "release"]
