"""Slightly damaged files, with wrong bytes or with one wrong value."""

from __future__ import annotations

import copy
import json
from typing import Any

import yaml
from hypothesis import strategies as st

TOKENS = [
    b"null", b"true", b"-1", b"0", b"1e999", b".nan", b".inf", b"NaN", b"Infinity", b"-0.0", b"[]",
    b"{}", b"''", b"[", b"}", b":", b"- ", b"\n", b"\t", b"\x00", b"\xff", b"\xef\xbb\xbf", b"? ",
    b"<<: {a: 1}\n", b"&a [*a]", b"!!python/object/apply:os.system ['true']", b"!!binary aGk=",
    b"2026-01-01", b"1" * 400, b"[" * 3000, b"NSNS", b"\xd9\xa3", b"1_0", b"0x10", b"12:30:45",
]  # fmt: skip

VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.sampled_from([0, 1, -1, 2**31, 2**63, 10**400])
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["NSNS", "", "LR", "tube", "../given", "given", "1e3", "\ud800"]),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=6,
)


@st.composite
def mutated(draw: st.DrawFn, whole: list[bytes], suffix: str) -> bytes:
    """Draw a file that differs slightly from a valid one."""
    content = draw(st.sampled_from(whole))
    if suffix in {".json", ".yaml"} and draw(st.booleans()):
        data = json.loads(content) if suffix == ".json" else yaml.safe_load(content)
        return _written(draw(_with_another_value(data)), suffix)
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, len(content)))
        until = min(len(content), at + draw(st.sampled_from([0, 0, 1, 4, 40])))
        put = draw(st.sampled_from(TOKENS) | st.binary(max_size=4) | st.just(content[at:until] * 2))
        content = content[:at] + put + content[until:]
    return content


@st.composite
def _with_another_value(draw: st.DrawFn, data: Any) -> Any:
    """Draw data in which one value, at any depth, is changed, removed or joined by another."""
    data = copy.deepcopy(data)
    holder: Any = {"": data}
    key: Any = ""
    while isinstance(holder[key], dict | list) and holder[key] and draw(st.integers(0, 4)):
        holder = holder[key]
        keys = sorted(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = draw(st.sampled_from(keys))
    how = draw(st.sampled_from(["another", "missing", "added"]))
    if how == "missing" and holder is not data and key != "":
        del holder[key]
    elif how == "added" and isinstance(holder, dict) and key != "":
        holder[draw(st.text(max_size=4))] = draw(VALUES)
    else:
        holder[key] = draw(VALUES)
        data = holder[""] if "" in holder and key == "" else data
    return data


def _written(data: Any, suffix: str) -> bytes:
    if suffix == ".json":
        return json.dumps(data).encode()
    return yaml.safe_dump(data, allow_unicode=True).encode("utf-8", errors="surrogatepass")
