"""A search on a Ray cluster by Ray Tune, whose trials are drawn by Optuna."""

# pyright: reportMissingImports=false

import json
from functools import partial
from pathlib import Path

import numba
import ray
from optuna.samplers import TPESampler
from ray import tune
from ray.tune import schedulers
from ray.tune.search.optuna import OptunaSearch

from agents.settings import SettingsError
from agents.tuning.search import Drawn, Search, Trial, run_trial
from agents.tuning.study import suggest
from magfold_env.checkpoint import difference
from magfold_env.files import physics_digest, write_text
from magfold_env.parallel import LOSSES

VALIDATION, FOLDER, ENDED = "validation", "folder", "ended"
"""Names of what trials report besides their results: the number of the validation, the run's
folder, and whether the run has come to its end."""


def search_on_ray(
    search: Search, output: Path, address: str | None = None, cpus: int = 1
) -> list[Trial]:
    """Run the trials that are left on a Ray cluster; return all that came to their end.

    A trial whose process or node is lost goes on elsewhere, from the last checkpoint in its run
    folder; so does the whole search if it is called again.

    The trials' runs lie in `output`, in a place that all nodes share; each takes so many `cpus`.
    The address is that of the cluster; None takes the one in ``RAY_ADDRESS``, or starts one here.

    Raises
    ------
    SettingsError
        If the folder holds another search.
    """
    output = output.resolve()
    _refuse_other(search, output)
    started = not ray.is_initialized()
    if started:
        ray.init(address=address, logging_level="warning", log_to_driver=False)
    try:
        results = _tuner(search, output, cpus).fit()
    finally:
        if started:
            ray.shutdown()
    found: list[Trial] = []
    for result in results:
        if result.config and result.metrics and result.metrics.get(ENDED):
            value = float(result.metrics[search.settings.objective])
            found.append(Trial(output / result.metrics[FOLDER], value, result.config))
    return found


def _refuse_other(search: Search, output: Path) -> None:
    """Note in `output` what is searched there; refuse anything else."""
    # Ray does not add trials to a search.
    key = search.key | {"trials": search.settings.trials, "physics": physics_digest()}
    file = output / "search.json"
    there = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else key
    if where := difference(there, key):
        raise SettingsError(f"{file}: is of another search, {where}; give another --output")
    output.mkdir(parents=True, exist_ok=True)
    write_text(file, json.dumps(key, indent=1) + "\n")


def _tuner(search: Search, output: Path, cpus: int) -> tune.Tuner:
    """Return what runs the trials, made or taken up."""
    settings = search.settings
    given = tune.with_parameters(_train, search=search, output=output, cpus=cpus)
    trainable = tune.with_resources(given, {"cpu": cpus})
    if tune.Tuner.can_restore(str(output / "ray")):
        return tune.Tuner.restore(str(output / "ray"), trainable, resume_errored=True)
    return tune.Tuner(
        trainable,
        tune_config=tune.TuneConfig(
            metric=settings.objective,
            mode="max",
            search_alg=OptunaSearch(
                partial(suggest, settings.space),
                metric=settings.objective,
                mode="max",
                sampler=TPESampler(n_startup_trials=settings.startup_trials),
            ),
            scheduler=_scheduler(search),
            num_samples=settings.trials,
        ),
        run_config=tune.RunConfig(
            name="ray",
            storage_path=str(output),
            failure_config=tune.FailureConfig(max_failures=LOSSES),
            verbose=1,
        ),
    )


def _scheduler(search: Search) -> schedulers.TrialScheduler:
    """Return what breaks trials off: Ray's likes of Optuna's pruners."""
    settings = search.settings
    if settings.pruner == "median":
        return schedulers.MedianStoppingRule(
            time_attr=VALIDATION,
            grace_period=settings.least_validations,
            min_samples_required=settings.startup_trials,
            min_time_slice=float("inf"),  # until there are as many, trials do not take turns
        )
    if settings.pruner == "hyperband":
        return schedulers.AsyncHyperBandScheduler(
            time_attr=VALIDATION,
            grace_period=settings.least_validations,
            max_t=search.validations,
            reduction_factor=3,
            stop_last_trials=False,
        )
    return schedulers.FIFOScheduler()


def _train(config: dict[str, Drawn], search: Search, output: Path, cpus: int) -> None:
    """Train as a trial says, in whichever process of the cluster; report its validations."""
    numba.set_num_threads(min(cpus, numba.get_num_threads()))
    folder = output / f"trial-{tune.get_context().get_trial_id()}"
    last = 0

    def watch(validation: int, result: dict[str, float]) -> None:
        nonlocal last
        last = validation
        tune.report({**result, VALIDATION: last, FOLDER: folder.name})

    result = run_trial(search.run_settings(config, folder.name), folder, watch)
    tune.report({**result, VALIDATION: last, FOLDER: folder.name, ENDED: True})
