"""docs/troubleshooting.md: what it quotes is said, and what `./run` says when it gives up is all there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
RUN = (ROOT / "run").read_text(encoding="utf-8")
QUOTED = re.findall(r"^\| `([^`]+)`[^|]*\|", PAGE, re.MULTILINE)
HOLE = "…"
WAITING = "waiting for "  # before what a pilot waits for


def shell_texts(pattern):
    """Texts of a kind of calls in ./run, with a hole for each variable."""
    for words in re.findall(pattern + r" ((?:\\\n\s*|\"[^\"]*\"|'[^']*'|\s)+)", RUN):
        text = " ".join(double or single for double, single in re.findall(r"\"([^\"]*)\"|'([^']*)'", words))
        yield re.sub(r"\$\{[^}]*\}|\$\w+(?:/\$\w+)*(?:/[\w.]+\.log)?", HOLE, text).replace(f"{HOLE}/{HOLE}", HOLE)


def python_texts():
    """Texts in the sources, with a hole for each value."""
    for path in sorted((ROOT / "sbs_sim").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
            elif isinstance(node, ast.JoinedStr):
                yield "".join(part.value if isinstance(part, ast.Constant) else HOLE for part in node.values)


GIVEN_UP = list(shell_texts(r"\bdie"))
SAID = [*GIVEN_UP, *shell_texts(r"\bprogress"), 'no executable "…"; …there are: …', *python_texts()]


def test_the_search_finds_texts():
    assert len(GIVEN_UP) == len(re.findall(r"(?m)(?:^|\s|\|\| )die [\"']", RUN)) >= 10
    assert "no space left: the environment needs 1 GB in …; remedy: make room and call again; see …" in GIVEN_UP
    assert len(QUOTED) > 50


@pytest.mark.parametrize("message", GIVEN_UP)
def test_all_that_ends_run_is_on_the_page(message):
    assert message in QUOTED


@pytest.mark.parametrize("message", QUOTED)
def test_what_is_quoted_is_said(message):
    """Each part between two holes; a message may be put together from several texts."""
    assert f"{WAITING}{HOLE}" in SAID
    for part in filter(None, (part.strip() for part in message.removeprefix(WAITING).split(HOLE))):
        assert any(part in text for text in SAID), part
