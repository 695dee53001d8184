"""Where compiled kernels are kept on disk: under which names, how they are read, and how long.

Numba's own cache notices edits in a kernel's file, but none in the files of what the kernel calls,
nor in those of constants and tuples, which are frozen into it. So every module that defines kernels
has a directory named after a hash of its source and of all that it imports from this package, at
any depth: an edit of an observation compiles observations again, and not the integrator. A file
begins with a hash of the rest of it; whatever is wrong with one, the kernel is compiled again.
"""

import hashlib
import os
import pickle
import pkgutil
import re
import shutil
import sys
import tempfile
import time
import uuid
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, cast

import numba
import platformdirs
from llvmlite import binding  # pyright: ignore[reportMissingTypeStubs]

PACKAGE = "magfold_env"
FOLDER = Path(__file__).parents[2]
KEPT = 30.0 * 24.0 * 3600.0  # [s] kernels of other versions are removed when not used for so long

# Numba's own modules know no types.
_core = cast("Any", numba).core
_llvm = cast("Any", binding)
# What a module imports when it is loaded; an import within a function freezes nothing.
_IMPORT = re.compile(
    rf"^(?:import +({PACKAGE}[\w.]*)|from +({PACKAGE}[\w.]*) +import +(\([^)]*\)|[^(\n]*))", re.M
)


# --- what a kernel is made from ------------------------------------------------------------


class Source(NamedTuple):
    """What is known of a module of this package."""

    digest: bytes
    imports: frozenset[str]
    is_package: bool


def imports(source: str) -> frozenset[str]:
    """Return what a source imports from this package at its top level.

    What follows ``from … import`` is among it whether it is a module's name or an object's.
    """
    found: set[str] = set()
    for plain, origin, names in _IMPORT.findall(source):
        found.add(plain or origin)
        found.update(f"{origin}.{name}" for name in re.findall(r"\w+", names))
    return frozenset(found)


@cache
def source_of(name: str) -> Source | None:
    """Return what is known of a module, or None if there is no such source."""
    parent = name.rpartition(".")[0]
    if parent and not ((above := source_of(parent)) and above.is_package):
        return None
    path = FOLDER.joinpath(*name.split(".")[1:])
    for file in (path / "__init__.py", path.with_suffix(".py")):
        with suppress(OSError):
            source = _read(file)
            digest = hashlib.sha256(source).digest()
            return Source(digest, imports(source.decode()), file.stem == "__init__")
    return None


def _read(file: Path) -> bytes:
    """Return a source, which may lie in an archive."""
    return __loader__.get_data(str(file))


def all_imports(names: frozenset[str]) -> dict[str, Source]:
    """Return the modules among some names, and all that they import."""
    found: dict[str, Source] = {}
    left = list(names)
    while left:
        name = left.pop()
        if name not in found and (source := source_of(name)) is not None:
            found[name] = source
            left += source.imports
    return found


@cache
def fingerprint(file: str) -> str | None:
    """Return a hash of all sources that a kernel in this file is made from.

    None if the file cannot be read, and so nobody can tell when it changes.
    """
    path = Path(file)
    try:
        source = _read(path)
    except OSError:
        return None
    digest = hashlib.sha256(source)
    inside = path.relative_to(FOLDER) if path.is_relative_to(FOLDER) else path
    digest.update(inside.as_posix().encode())
    for name, each in sorted(all_imports(imports(source.decode()) | _compilation()).items()):
        digest.update(name.encode() + each.digest)
    return digest.hexdigest()[:16]


@cache
def _compilation() -> frozenset[str]:
    """Return the modules that decide how kernels are compiled."""
    folder = str(Path(__file__).parent)
    return frozenset(f"{__package__}.{each.name}" for each in pkgutil.iter_modules([folder]))


# --- directories ---------------------------------------------------------------------------


@cache
def cache_root() -> Path | None:
    """Return the folder of all directories of kernels, or None where nothing can be written.

    ``NUMBA_CACHE_DIR`` moves it.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir(PACKAGE)
    for root in (Path(chosen), FOLDER / "__pycache__"):
        with suppress(OSError):
            root.mkdir(parents=True, exist_ok=True)
            if os.access(root, os.W_OK):
                return root
    return None


@cache
def cache_directory(file: str) -> Path | None:
    """Return the directory for kernels defined in a file, and note that it is in use."""
    key, root = fingerprint(file), cache_root()
    if key is None or root is None:
        return None
    directory = root / f"kernels-{key}"
    mark_used(directory)
    return directory


def mark_used(directory: Path) -> None:
    """Note on the directory, if it is there, that it is in use."""
    with suppress(OSError):
        os.utime(directory)


def remove_unused(root: Path | None = None) -> None:
    """Remove the directories that no process has begun to use within `KEPT`.

    A process that still uses one after such a time only finds less to load.
    """
    root = root or cache_root()
    if root is None:
        return
    for directory in root.glob("kernels-" + "[0-9a-f]" * 16):
        with suppress(OSError):
            if time.time() - directory.stat().st_mtime > KEPT:
                shutil.rmtree(directory, ignore_errors=True)


def write(path: Path, content: bytes) -> None:
    """Write a file that is there as a whole or not at all; one that cannot be written is not."""
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(content)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


# --- files ---------------------------------------------------------------------------------


class KernelCache:
    """What numba asks for machine code before it compiles a function, and gives it to afterwards.

    Parameters
    ----------
    function
        The function in Python.
    directory
        Where its files are.
    linked
        Whether the compiled function is linked into others, which takes its intermediate code too.
    """

    def __init__(self, function: Any, directory: Path, *, linked: bool) -> None:
        code = function.__code__
        self._linked = linked
        self.cache_path = str(directory)
        name = f"{Path(code.co_filename).stem}.{function.__qualname__}-{code.co_firstlineno}"
        self._name = name.replace("<", "").replace(">", "")

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature; None if it is not there or damaged."""
        # Numba's own caches refresh the context first: half a second, in which all that can be
        # compiled is registered. Compiled code needs no more than the runtime for memory.
        _core.runtime.rtsys.initialize(target_context)
        try:
            content = self._path(sig, target_context.codegen()).read_bytes()
            size = hashlib.sha256().digest_size
            if hashlib.sha256(content[size:]).digest() != content[:size]:
                return None
            payload = pickle.loads(content[size:])
            return _core.compiler.CompileResult._rebuild(target_context, *payload)
        except Exception:
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and not data.lifted:
            (name, kind, (machine_code, intermediate)), *rest = data._reduce()
            if not self._linked:
                intermediate = names_alone(intermediate)
            library = name, kind, (machine_code, intermediate)
            content = _core.serialize.dumps((library, *rest))
            path = self._path(sig, data.library.codegen)
            write(path, hashlib.sha256(content).digest() + content)

    def _path(self, sig: Any, codegen: Any) -> Path:
        key = repr((str(sig), codegen.magic_tuple(), numba.__version__, sys.version_info[:2]))
        digest = hashlib.sha256(key.encode()).hexdigest()[:16]
        return Path(self.cache_path) / f"{self._name}.{digest}.nbc"


def names_alone(intermediate: bytes) -> bytes:
    """Return intermediate code that defines the same names, which is all that numba looks up in it.

    Reading all of it takes half the time that a kernel takes to load.
    """
    module = _llvm.parse_bitcode(intermediate)
    symbols = (*module.functions, *module.global_variables)
    names = [each.name for each in symbols if not each.is_declaration]
    stubs = "\n".join(f'define void @"{name}"() {{ ret void }}' for name in names)
    return _llvm.parse_assembly(stubs).as_bitcode()


def keep(kernel: Any, *, linked: bool) -> None:
    """Keep what is compiled of a kernel on disk, and load it from there.

    One that closes over variables is compiled anew in every process.

    Parameters
    ----------
    kernel
        A function compiled by numba.
    linked
        Whether it may be linked into others as it is compiled by itself.
    """
    function = kernel.py_func
    directory = cache_directory(function.__code__.co_filename)
    if directory is not None and function.__closure__ is None:
        kernel._cache = KernelCache(function, directory, linked=linked)


def check() -> None:
    """Raise an error unless what is kept of a function is found again."""

    def double(x: float) -> float:
        return 2.0 * x

    compiled = cast("Any", numba.njit)("float64(float64)")(double)
    (signature,) = compiled.overloads
    with tempfile.TemporaryDirectory() as folder:
        kept = KernelCache(double, Path(folder), linked=False)
        kept.save_overload(signature, compiled.overloads[signature])
        found = kept.load_overload(signature, compiled.targetctx)
    if found is None or found.entry_point(0.5) != double(0.5):
        raise RuntimeError("what was kept is not found again")
