"""Files that hold a run's state: whole or not at all, and of one run only."""

import hashlib
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from magfold_env.checkpoint import CheckpointError, difference
from magfold_env.files import replacing

MANIFEST = "manifest.json"

UNREADABLE = (
    OSError,
    ValueError,  # among them are wrong text and wrong JSON
    AttributeError,
    KeyError,
    TypeError,
    RuntimeError,  # encrypted, of an unknown method, or nested too deeply
    EOFError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading a file that is no zip file, or a damaged one, may raise."""


def write_archive(path: Path, key: Mapping[str, Any], members: Mapping[str, bytes]) -> None:
    """Write `members` to a zip file at `path`, under a temporary name until it is whole.

    Parameters
    ----------
    path : Path
        Where; a file that is there is replaced.
    key : mapping
        Everything that the members depend on, as values that JSON can hold.
    members : mapping
        Contents by name.
    """
    manifest = {
        "key": key,
        "sha256": {name: hashlib.sha256(content).hexdigest() for name, content in members.items()},
    }
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        archive.writestr(MANIFEST, json.dumps(manifest, indent=1))
        for name, content in members.items():
            archive.writestr(name, content)


def read_archive(path: Path, key: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the members of the file at `path`.

    Raises
    ------
    CheckpointError
        If the file is damaged, or has another key.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            manifest = json.loads(archive.read(MANIFEST))
            members = {name: archive.read(name) for name in manifest["sha256"]}
            found = manifest["key"]
        wrong = [n for n in members if _sha256(members[n]) != manifest["sha256"][n]]
    except UNREADABLE as e:
        raise CheckpointError(f"{path}: is damaged ({e}); {_REMEDY}") from None
    if wrong:
        raise CheckpointError(f"{path}: is damaged ({wrong[0]} is not what was saved); {_REMEDY}")
    if where := difference(found, json.loads(json.dumps(key))):
        raise CheckpointError(f"{path}: was written by another run, {where}; {_REMEDY}")
    return members


_REMEDY = "train afresh, or in another folder"


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
