"""`python -m magfold_env.browser`: write the engine for browsers into a folder."""

import gzip
import shutil
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from magfold_env.browser import build

options: Any = import_module("magfold_env.cli.options")  # only commands may import from above


def main(
    out: Annotated[Path, typer.Option(help="Folder to write to.")] = Path("lab"),
    pack: Annotated[
        bool, typer.Option("--pack", help="Put the page into the package too, for a wheel.")
    ] = False,
) -> None:
    """Compile the kernels to WebAssembly, pack the memory that they work on, and write the page."""
    with options.errors_in_one_line((RuntimeError,)):
        options.check_folder("--out", out)
        sizes = build.build(out)
    if pack:
        shutil.copy(out / build.PAGE, build.PACKED)
    for name, size in sizes.items():
        packed = len(gzip.compress(out.joinpath(name).read_bytes(), mtime=0))
        typer.echo(f"{out / name}: {size / 1e3:.0f} kB, {packed / 1e3:.0f} kB gzipped")


if __name__ == "__main__":
    options.application_of(main)()
