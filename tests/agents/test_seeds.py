from agents.seeds import MAX_TRAINING_SEED, episode_seeds


def test_streams_share_no_seed_with_each_other_or_with_training() -> None:
    evaluation, validation = episode_seeds("evaluation", 500), episode_seeds("validation", 500)
    assert len({*evaluation, *validation}) == 1000
    # Training seeds its environments with its own seed plus their number.
    assert min(evaluation + validation) > 2 * MAX_TRAINING_SEED


def test_a_longer_list_begins_with_the_shorter() -> None:
    assert episode_seeds("evaluation", 20)[:5] == episode_seeds("evaluation", 5)
