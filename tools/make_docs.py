"""Make the site of docs/: the guide, the theory, and the reference with the documentation of every module.

    ./run python tools/make_docs.py --out site

What generates it is installed once, by what this script says if it is missing. The pages are copied into a temporary
folder, where those of the modules are added, and checked: a link that leads nowhere is an error.
"""

import argparse
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GENERATOR = ROOT / ".cache" / "docs"  # not in the environment: it needs another docutils than that
INSTALL = "./run python -m pip install --no-deps --target .cache/docs -r docs/requirements.txt"
FONT = "ziamath/fonts/STIXTwoMath-Regular.ttf"
COPIED = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "docs", "config", "sbs_sim", "test/data")
FIRST_PAGE = '<!DOCTYPE html><meta http-equiv="refresh" content="0; url=docs/index.html"><title>sbs_sim</title>\n'
MODULE_LINK = re.compile(r"\[`(sbs_sim[\w.]*)`\]\(\.\./\.\./sbs_sim/[\w/]+\.py\)")


def copy_pages(source: Path) -> None:
    """Copy all that pages are made of, or link to."""
    ignored = shutil.ignore_patterns("__pycache__", "*.pyc")
    for name in COPIED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name, ignore=ignored)
        else:
            shutil.copy(ROOT / name, source / name)
    shutil.copy(GENERATOR / FONT, source / "docs" / "static")


def add_modules(source: Path) -> None:
    """Add a page for each module that docs/reference/api.md names, and lead its links there.

    They are not in the side bar: with some hundreds of entries on every page it took two thirds of the time.
    """
    index = source / "docs" / "reference" / "api.md"
    text = index.read_text(encoding="utf-8")
    folder = index.with_name("api")
    folder.mkdir()
    names = MODULE_LINK.findall(text)
    for name in names:
        page = f":orphan:\n\n{name}\n{'=' * len(name)}\n\n:doc:`All modules <../api>`\n\n.. automodule:: {name}\n"
        (folder / f"{name}.rst").write_text(page, encoding="utf-8")
    index.write_text(MODULE_LINK.sub(r"[`\1`](api/\1.rst)", text), encoding="utf-8")


def add_contents(source: Path) -> None:
    """Add what the side bar shows: the pages that the first one links to, section by section."""
    index = source / "docs" / "index.md"
    text = index.read_text(encoding="utf-8")
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)
    sections = zip(["", *parts[1::2]], parts[::2], strict=True)
    for title, part in sections:
        links = re.findall(r"\[([^\]]+)\]\(([\w./]+\.md)\)", part)
        text += contents(title, [f"{name} <{page}>" for name, page in links])
    index.write_text(text, encoding="utf-8")


def contents(title: str, pages: list[str]) -> str:
    """A table of contents that only the side bar shows."""
    options = [":hidden:", *([f":caption: {title}"] if title else [])]
    return "\n".join(["", "```{toctree}", *options, "", *pages, "```", ""])


def main() -> int:
    """Make the site."""
    parser = argparse.ArgumentParser(prog="make_docs", description="Make the site of docs/.")
    parser.add_argument("--out", default="site", metavar="DIR", help="folder to write (default: site)")
    out = Path(parser.parse_args().out).resolve()
    sys.path.insert(0, str(GENERATOR))
    os.environ["NUMBA_DISABLE_JIT"] = "1"  # compiled functions hide their signatures and docstrings
    try:
        import math_core  # noqa: F401
        import myst_parser  # noqa: F401
        from sphinx.cmd.build import build_main
    except ImportError as error:
        print(f"no {error.name}: {INSTALL}", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as temporary:
        source = Path(temporary) / "source"
        source.mkdir()
        copy_pages(source)
        add_modules(source)
        add_contents(source)
        options = ["--quiet", "--fail-on-warning", "--keep-going", "--doctree-dir", str(Path(temporary) / "trees")]
        code = build_main([*options, "--conf-dir", str(source / "docs"), str(source), str(out)])
    if code == 0:
        (out / "index.html").write_text(FIRST_PAGE, encoding="utf-8")
        print(f"written: {out / 'index.html'}")
    return code


if __name__ == "__main__":
    sys.exit(main())
