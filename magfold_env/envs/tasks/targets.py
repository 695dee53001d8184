"""The fold words that an episode may ask for."""

from collections.abc import Sequence

from magfold_env.shapes import folded_words, overlaps

LONGEST_LISTED = 16
"""Most components of a chain whose words are all listed: 8,894, three times more with two more."""


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
        if n > LONGEST_LISTED:
            raise ValueError(
                f"targets: None is not allowed with {n} components, which have too many words; "
                f"must be a list (up to {LONGEST_LISTED} components all words are taken)"
            )
        return tuple(folded_words(n))
    if not _is_list(targets) or not targets:
        raise ValueError(f"targets: {targets!r} is not allowed; must be a list of fold words")
    for word in targets:
        if not is_target(word, n):
            raise ValueError(
                f"targets: {word!r} is not allowed; must be a fully folded word of {n} "
                f"components without overlap, such as {_examples(n)}"
            )
    return tuple(targets)


def _is_list(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def is_target(word: object, n: int) -> bool:
    """Return whether `word` is a fully folded word of `n` components without overlap."""
    return (
        isinstance(word, str)
        and len(word) == n - 1
        and not set(word) - set("LR")
        and not overlaps(word)
    )


def _examples(n: int) -> str:
    """Return some words that are allowed, as text."""
    return _listed(folded_words(n)) if n <= LONGEST_LISTED else ("LR" * n)[: n - 1]


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
