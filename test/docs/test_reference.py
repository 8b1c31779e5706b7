"""docs/reference: the pages say what the interfaces, parameters, command lines and docstrings say."""

import argparse
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import update_reference as reference  # noqa: E402

EXECUTABLES = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"


def written(name):
    return (ROOT / "docs" / "reference" / f"{name}.md").read_text()


@pytest.mark.parametrize("name", reference.PAGES)
def test_a_page_is_up_to_date(name):
    assert written(name) == reference.PAGES[name](), "remedy: ./run python tools/update_reference.py"


def test_no_interface_and_no_field_is_missing():
    text = {"msg": written("topics"), "srv": written("services"), "action": written("services")}
    count = 0
    for path in [*(ROOT / "msg_defs").glob("*/*.*")]:
        _, _, section = text[path.suffix[1:]].partition(f"## {path.stem}\n")
        section = re.split(r"\n###? ", section)[0]
        for name in re.findall(r"^\w[\w/\[\]]* (\w+)", path.read_text(), flags=re.MULTILINE):
            assert f"**`{name}`**" in section, f"{path.name}: {name}"
            count += 1
    assert count > 150


def test_topics_and_services_are_those_of_the_guide():
    guide = (ROOT / "docs" / "ros_interface.md").read_text()
    for heading, page in (("## Topics", "topics"), ("## Services", "services")):
        reported = re.findall(r"^\| `([/\w]+)` \| `(\w+/\w+)`", guide.split(heading)[1].split("\n##")[0], re.MULTILINE)
        listed = re.findall(r"^\| `([/\w]+)` \|[ \w]*\|? \[?`(\w+/\w+)`", written(page), re.MULTILINE)
        assert len(reported) >= 6
        assert {name for name, _ in listed} - {"sweep"} == {name for name, _ in reported}
        assert set(reported) - set(listed) == set()


def test_every_executable_has_its_section():
    headings = re.findall(r"^## (\w+)$", written("commands"), re.MULTILINE)
    assert headings == list(reference.executables())
    assert all((EXECUTABLES / name).exists() for name in headings)


def test_every_option_is_documented():
    for name, module in reference.executables().items():
        parser = reference.parser_of(module)
        if parser is not None:
            _, _, section = written("commands").partition(f"\n## {name}\n")
            for option, action in parser._option_string_actions.items():
                if action.help != argparse.SUPPRESS and option not in {"-h", "--help", "--version"}:
                    assert f"`{option}" in section.split("\n## ")[0], option


def test_comments_are_not_taken_for_markdown():
    assert reference.cell("bags/<date>_<time> | n * n, a_b, `x_<y>`") == (
        r"bags/\<date>\_\<time> \| n \* n, a_b, `x_<y>`"
    )
