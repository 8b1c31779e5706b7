"""docs/theory.md: what it names exists, what cites it finds its section, and its links and equations are whole."""

import ast
import json
import re
from pathlib import Path

import pytest

from sbs_sim.model import records

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "theory.md"
TEXT = PAGE.read_text(encoding="utf-8")
MARKS = ("<!-- reproduction: begin -->", "<!-- reproduction: end -->")
WRITTEN = TEXT.split(MARKS[0])[0] + TEXT.split(MARKS[1])[-1]  # without the generated tables
PAGES = ("theory",)  # names under which docstrings cite the page
CITING = ("sbs_sim", "msg_defs", "config", "test", "tools")
SUFFIXES = {".py", ".msg", ".srv", ".action", ".yaml", ".json", ".csv", ".md", ".txt", ".xml"}
LAST_EQUATION = 34  # of the paper

HEADINGS = re.findall(r"^#+ (.+)$", TEXT, flags=re.MULTILINE)
SECTIONS = {heading.split()[0] for heading in HEADINGS if heading[0].isdigit()}
DISPLAYS = re.findall(r"^\$\$\n(.*?)\n\$\$$", WRITTEN, flags=re.MULTILINE | re.DOTALL)
PROSE = re.sub(r"^\$\$\n.*?\n\$\$$", "", WRITTEN, flags=re.MULTILINE | re.DOTALL)
INLINE = re.findall(r"\$([^$\n]+)\$", PROSE)


# -- places in the code ----------------------------------------------------------------------------------------------


def code_references():
    """Pairs of a file and the names that the page says are in it."""
    found = []
    for paragraph in re.findall(r"^Code: (.+?)(?:\n\n|\Z)", WRITTEN, flags=re.MULTILINE | re.DOTALL):
        plain = re.sub(r"\([^()]*\)", "", paragraph)  # what is in parentheses are equations and fields
        for part in plain.split(";"):
            path, _, names = part.partition("`: ")
            assert path.count("`") == 1 or not names, f"no file before the names in {part!r}"
            for file in re.findall(r"`([\w/]+\.py)", path):
                found.append((file, tuple(re.findall(r"`([\w.]+)`", names))))
    return found


def definitions(path):
    """Functions and classes of a file, methods with their class."""
    names = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        if isinstance(node, ast.ClassDef):
            names |= {f"{node.name}.{part.name}" for part in node.body if isinstance(part, ast.FunctionDef)}
    return names


@pytest.mark.parametrize(("file", "names"), code_references())
def test_named_code_exists(file, names):
    assert set(names) - definitions(ROOT / file) == set()


def test_every_section_names_its_code():
    assert len(code_references()) > 30
    parts = re.split(r"^## (?=\d)", WRITTEN.split("## Open choices")[0], flags=re.MULTILINE)[1:]
    assert [part.split()[0] for part in parts] == [str(number) for number in range(1, 12)]
    assert [part.split("\n")[0] for part in parts if "\nCode: `" not in part] == []


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:\w+/)+\w+\.\w+)`", WRITTEN))))
def test_named_files_exist(path):
    assert (ROOT / path).is_file()


def test_numerical_modules_are_all_there():
    """Every file of the model is named by the page, but for what holds no equation."""
    helpers = {"__init__", "kernel", "kernel_cache", "records", "state", "wind_columns"}
    missing = [path.stem for path in (ROOT / "sbs_sim/model").glob("*.py") if path.name not in TEXT]
    assert set(missing) <= helpers


# -- columns and keys ------------------------------------------------------------------------------------------------


def table_rows(heading):
    """Cells of the first table under a heading."""
    block = WRITTEN.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = [line.strip("|").split("|") for line in block.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row] for row in rows[2:]]


def schema_keys():
    """Keys of an aircraft file, those of rotors as "rotors.key"."""
    schema = json.loads((ROOT / "config/aircraft.schema.json").read_text(encoding="utf-8"))["properties"]
    keys = set(schema)
    for part in ("environment", "body", "options", "controls"):
        keys |= {f"{part}.{key}" for key in schema[part].get("properties", ())}
    surface, fuselage = schema["body"]["properties"]["surfaces"]["items"], schema["body"]["properties"]["fuselage"]
    keys |= {f"surfaces.{key}" for key in surface["properties"]} | {f"fuselage.{key}" for key in fuselage["properties"]}
    keys |= {f"wash.{key}" for key in surface["properties"]["wash"]["properties"]}
    keys |= {f"ground.{key}" for key in schema["ground"]["properties"]}
    keys |= {f"contact_points.{key}" for key in schema["contact_points"]["items"]["properties"]}
    return keys | {f"rotors.{key}" for key in schema["rotors"]["items"]["properties"]}


def test_fields_of_the_symbols_exist():
    known = {name for fields in vars(records).values() if isinstance(fields, dict) for name in fields}
    columns = {name for row in table_rows("Symbols") for name in re.findall(r"`(\w+)`", row[3])}
    assert columns
    assert columns <= known


def test_keys_of_the_symbols_exist():
    ends = {key.rpartition(".")[2] for key in schema_keys()}
    keys = {name for row in table_rows("Symbols") for name in re.findall(r"`(\w+)`", row[2])}
    assert keys
    assert keys <= ends


@pytest.mark.parametrize("row", table_rows("Open choices"), ids=lambda row: row[0])
def test_every_choice_names_its_key(row):
    assert len(row) == 4
    assert all(row)
    if row[2] != "none" and not row[2].startswith(("argument", "service")):
        keys = re.findall(r"`([\w.]+)`", row[2])
        assert keys
        assert set(keys) <= schema_keys()


# -- citations -------------------------------------------------------------------------------------------------------

CITATION = re.compile(
    rf"\b(?:{'|'.join(PAGES)})\.md,?[\s#]+(?:sections?[\s#]+)?"
    r"(\d+(?:\.\d+)?(?:(?:,| and| to)[\s#]+\d+(?:\.\d+)?)*)"
)


def cited_sections():
    """Files of the repository and the sections of the page that they cite."""
    found = []
    for folder in CITING:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES and "__pycache__" not in path.parts:
                text = path.read_text(encoding="utf-8")
                found += [(str(path.relative_to(ROOT)), match[1]) for match in CITATION.finditer(text)]
    return found


def test_sections_are_found_in_all_their_forms():
    text = "theory.md section 3; theory.md sections 2 to 5. theory.md, sections 1,\n# 3 and 9.2, (theory.md 8 and 9)"
    assert CITATION.findall(text) == ["3", "2 to 5", "1,\n# 3 and 9.2", "8 and 9"]


def test_cited_sections_exist():
    cited = cited_sections()
    assert len(cited) > 30
    wrong = [(path, text) for path, text in cited if not set(re.findall(r"\d+(?:\.\d+)?", text)) <= SECTIONS]
    assert wrong == []


def test_sections_of_the_page_itself_exist():
    numbers = re.findall(r"[Ss]ections? (\d+(?:\.\d+)?)(?: to (\d+(?:\.\d+)?))?", re.sub(r"\$[^$]*\$", "", PROSE))
    # section numbers of other works stand behind their names or in the paper's own
    other = {"2.1.1", "2.2", "3.1", "3.7", "4A"}
    own = {number for pair in numbers for number in pair if number} - other - {"2.1"}
    assert own
    assert own <= SECTIONS


# -- links -----------------------------------------------------------------------------------------------------------


def anchor(heading):
    """Name that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("page", [PAGE, ROOT / "README.md"], ids=lambda page: page.name)
def test_links_resolve(page):
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    assert targets
    for target in targets:
        if re.match(r"[a-z]+:", target):
            continue
        path, _, name = target.partition("#")
        linked = (page.parent / path) if path else page
        assert linked.exists(), target
        if name:
            headings = re.findall(r"^#+ (.+)$", linked.read_text(encoding="utf-8"), flags=re.MULTILINE)
            assert name in map(anchor, headings), target


def test_every_image_is_shown_and_described():
    shown = re.findall(r"!\[([^\]]+)\]\(images/([\w]+\.svg)\)", TEXT)
    assert {name for _, name in shown} == {path.name for path in (ROOT / "docs/images").glob("*.svg")}
    assert min(len(description) for description, _ in shown) > 20


def test_images_are_those_of_the_script():
    tree = ast.parse((ROOT / "tools/make_theory_figures.py").read_text(encoding="utf-8"))
    table = next(
        node for node in tree.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "FIGURES"
    )
    names = set(map(ast.literal_eval, table.value.keys))
    assert {path.stem for path in (ROOT / "docs/images").glob("*.svg")} == names


@pytest.mark.parametrize("path", sorted((ROOT / "docs/images").glob("*.svg")), ids=lambda path: path.name)
def test_images_do_not_hold_the_day_they_were_made(path):
    assert "<dc:date>" not in path.read_text(encoding="utf-8")


# -- equations -------------------------------------------------------------------------------------------------------


def test_equations_are_numbered_one_after_the_other():
    tags = [tag for display in DISPLAYS for tag in re.findall(r"\\tag\{([\d.]+)\}", display)]
    assert len(tags) == len(DISPLAYS)
    last = dict.fromkeys(range(1, 12), 0)
    for tag in tags:
        section, number = map(int, tag.split("."))
        assert number == last[section] + 1, tag
        last[section] = number
    assert min(last.values()) > 0


def test_equations_are_in_their_sections():
    for part in re.split(r"^## (?=\d)", WRITTEN, flags=re.MULTILINE)[1:]:
        number = part.split()[0]
        assert set(re.findall(r"\\tag\{(\d+)\.", part.split("\n## ")[0])) == {number}


def test_cited_equations_exist():
    tags = set(re.findall(r"\\tag\{([\d.]+)\}", WRITTEN))
    cited = set()
    for inside in re.findall(r"\(([^()$]*\d\.\d[^()$]*)\)", PROSE):
        if not re.search(r"[Ss]ection|measured|printed|m/s|deg|\d ?%", inside):
            cited |= set(re.findall(r"(?<![\d.-])([1-9]\.\d{1,2})(?![\d.]|e-)", inside))
    assert len(cited) > 30
    assert cited - tags == set()


def test_cited_equations_of_the_paper_exist():
    cited = {int(number) for number in re.findall(r"\[(\d+)\](?!\()", PROSE)}
    assert {1, 13, 26, 32, 34} <= cited
    assert max(cited) <= LAST_EQUATION


# What GitHub may take for Markdown or HTML before it finds the equations.
SPOILERS = {
    "escaped punctuation, or a new row within a line": r"\\[!-/:-@\[\]^_`{|}~]",
    "an asterisk": r"\*",
    "an underscore that may begin an emphasis": r"(?<![A-Za-z0-9])_",
    "a line like a list, a heading, or empty": r"(?m)^\s*(?:[-+=>#]\s|\d+[.)]\s|$)",
    "something like a tag": r"<\S",
}


def test_equations_survive_markdown():
    for math in [*DISPLAYS, *INLINE]:
        text = re.sub(r"\\\\$", "", math, flags=re.MULTILINE)  # new rows, as they should be
        assert [name for name, pattern in SPOILERS.items() if re.search(pattern, text)] == [], math


def test_brackets_of_equations_are_closed():
    for math in [*DISPLAYS, *INLINE]:
        for left, right in (("{", "}"), ("\\left(", "\\right)"), ("\\left[", "\\right]"), ("\\begin{", "\\end{")):
            assert math.count(left) == math.count(right), math


def test_inline_equations_have_spaces_around_them():
    """A letter, digit or hyphen at a dollar keeps GitHub from finding the equation."""
    without_code = re.sub(r"`[^`\n]*`", "code", PROSE)
    assert without_code.count("$") == 2 * len(INLINE)
    for match in re.finditer(r"(.?)\$([^$\n]+)\$(.?)", without_code):
        before, inside, after = match.groups()
        assert not re.match(r"[\w-]", before), match[0]
        assert not re.match(r"[\w-]", after), match[0]
        assert inside == inside.strip(), match[0]
    for row in re.findall(r"^\|.*\|$", PROSE, flags=re.MULTILINE):
        assert not any("|" in math for math in re.findall(r"\$([^$\n]+)\$", row)), row


# -- the generated tables --------------------------------------------------------------------------------------------


def test_tables_of_the_reproduction_are_in_their_section():
    assert [TEXT.count(mark) for mark in MARKS] == [1, 1]
    before, inside = TEXT.split(MARKS[1])[0].split(MARKS[0])
    assert before.rstrip().split("\n### ")[-1].startswith("9.10 ")
    assert all(f"**Table {number}" in inside for number in range(1, 6))
    rows = [line for line in inside.splitlines() if line.startswith("|")]
    assert len(rows) > 40
