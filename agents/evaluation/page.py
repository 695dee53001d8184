"""One HTML file that shows a comparison: numbers, pictures, and folds that play."""

import base64
import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

from agents.evaluation.provenance import provenance
from agents.evaluation.replays import Replay
from agents.evaluation.report import Summary, overall_rows
from agents.settings.run import EnvSettings
from magfold_env.files import write_text

_CAPTIONS = {
    "overall": "Success with 95 % intervals.",
    "profile": "Performance profile: the share of targets (and seeds) with more success than τ.",
    "reasons": "How episodes ended, and which joints were in the way of those that missed.",
    "targets": "Success by target with Wilson's 95 % intervals; dots are single seeds.",
}


def write_page(
    path: Path,
    settings: EnvSettings,
    draws: int,
    summaries: Mapping[str, Summary],
    pictures: Mapping[str, Path],
    shown: Mapping[str, Sequence[Replay]],
) -> None:
    """Write the page; it needs nothing but itself.

    Parameters
    ----------
    path : Path
        Where to.
    settings : EnvSettings
        Where the methods played.
    draws : int
        Episodes of each run on each target.
    summaries : mapping
        What follows, by method.
    pictures : mapping
        PNG files, by what they show.
    shown : mapping
        Folds to play, by method.
    """
    pages = [replay.page for replays in shown.values() for replay in replays]
    text = Template(_file("report.html")).substitute(
        title=f"{len(summaries)} methods on {len(_first(summaries).targets)} targets",
        settings=html.escape(_settings(settings, draws)),
        overall=_overall(summaries),
        pictures="\n".join(_picture(pictures[name], _CAPTIONS[name]) for name in _CAPTIONS),
        replays=_choices(shown),
        targets=_by_target(summaries),
        provenance="".join(
            f"<dt>{html.escape(key)}</dt><dd>{html.escape(_text(value))}</dd>"
            for key, value in provenance().items()
        ),
        # Nothing in a page, `</script>` for one, may end the script that holds it.
        pages=json.dumps(pages).replace("<", "\\u003c"),
    )
    write_text(path, text)


def _settings(settings: EnvSettings, draws: int) -> str:
    """Return which environment it was, and what differs from its defaults, in words."""
    given = {"randomisation": "nominal"} | settings.unshaped().options()
    if not isinstance(given.get("targets", ""), str):
        del given["targets"]  # the tables name them
    told = ", ".join(f"{key} {_text(value)}" for key, value in given.items())
    return f"{settings.id}, {told}; {draws} draws of each target that no training or search saw."


def _overall(summaries: Mapping[str, Summary]) -> str:
    rows = overall_rows(list(summaries.values()))
    lines = [[name, *(cells[k] for cells in rows.values())] for k, name in enumerate(summaries)]
    return _table(["", *rows], lines)


def _by_target(summaries: Mapping[str, Summary]) -> str:
    lines = [
        [word, *(str(each.targets[word]) for each in summaries.values())]
        for word in _first(summaries).targets
    ]
    return _table(["target", *summaries], lines)


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    names = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>"
        for line in lines
    )
    return f"<table><thead><tr>{names}</tr></thead><tbody>{rows}</tbody></table>"


def _picture(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    text = html.escape(caption)
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{text}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def _choices(shown: Mapping[str, Sequence[Replay]]) -> str:
    """Return a table of buttons, a row a method, above the frame that plays what they name."""
    if not any(shown.values()):
        return "<p>There is no motion to show: the chain was not simulated.</p>"
    rows: list[str] = []
    number = 0
    for name, replays in shown.items():
        buttons: list[str] = []
        for replay in replays:
            buttons.append(_button(number, replay))
            number += 1
        rows.append(f"<tr><td>{html.escape(name)}</td><td>{' '.join(buttons)}</td></tr>")
    return (
        "<p class='faint'>The first draw of some targets, evenly picked, and a miss if these have "
        "none: the target, and what became of it.</p>"
        f"<table id='choices'><tbody>{''.join(rows)}</tbody></table>"
        '<iframe id="viewer" title="Fold"></iframe>'
    )


def _button(number: int, replay: Replay) -> str:
    outcome = replay.outcome
    became = "✓" if outcome.success else f"→ {outcome.word}, {outcome.status}"
    kind = "" if outcome.success else " class='missed'"
    return (
        f"<button type='button' data-page='{number}' aria-pressed='false'{kind}>"
        f"<span class='word'>{outcome.target}</span> {html.escape(became)}</button>"
    )


def _text(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _first(summaries: Mapping[str, Summary]) -> Summary:
    return next(iter(summaries.values()))


def _file(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")
