"""The fold words that an episode may ask for."""

from collections.abc import Sequence

from magfold_env.shapes import folded_words, overlaps


def resolve_targets(targets: Sequence[str] | None, n: int) -> tuple[str, ...]:
    """Return the target words of a chain of `n` components.

    Parameters
    ----------
    targets : sequence of str or None
        Words to draw from; None stands for every fully folded word of the chain.
    n : int
        Number of components.

    Raises
    ------
    ValueError
        If a word is not a fully folded word of the chain, or none is given.
    """
    if targets is None:
        return tuple(folded_words(n))
    if isinstance(targets, str) or not targets:
        raise ValueError(f"targets: {targets!r} is not allowed; must be a list of fold words")
    for word in targets:
        if len(word) != n - 1 or set(word) - set("LR") or overlaps(word):
            raise ValueError(
                f"targets: {word!r} is not allowed; must be a fully folded word of {n} "
                f"components without overlap, such as {_listed(folded_words(n))}"
            )
    return tuple(targets)


def pick_target(word: object, targets: Sequence[str]) -> str:
    """Return `word` if it is one of `targets`.

    Raises
    ------
    ValueError
        If it is not.
    """
    if word not in targets:
        raise ValueError(
            f"options['target']: {word!r} is not allowed; must be one of {_listed(targets)}"
        )
    return str(word)


def _listed(words: Sequence[str], most: int = 40) -> str:
    """Return `words` as text, cut short where there are very many."""
    more = "" if len(words) <= most else f", … ({len(words)} in all)"
    return ", ".join(words[:most]) + more
