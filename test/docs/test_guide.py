"""README and docs: links lead somewhere, blocks of Python run, command lines are such that the executables take them.

docs/tutorial.md has tests of its own beside these (test_tutorial.py), and docs/reference (test_reference.py).
"""

import ast
import contextlib
import importlib
import importlib.util
import io
import itertools
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import make_docs  # noqa: E402
import update_reference as reference  # noqa: E402

PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
NAMES = [page.relative_to(ROOT).as_posix() for page in PAGES]
ROS = ("rclpy", "sbs_msgs", "geometry_msgs", "std_msgs", "std_srvs")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TRIED_ELSEWHERE = ("docs/tutorial.md",)


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def prose_of(name):
    """A page without blocks and code, in which brackets are no links."""
    return re.sub(r"`[^`\n]*`", "code", BLOCK.sub("", text_of(name)))


def blocks(name, language):
    return [body for kind, body in BLOCK.findall(text_of(name)) if kind == language]


# -- links -----------------------------------------------------------------------------------------------------------


def anchors(page):
    """Anchors as GitHub makes them of headings, numbered where headings are alike."""
    found = {}
    for heading in re.findall(r"^#{1,6} (.+)$", BLOCK.sub("", page.read_text(encoding="utf-8")), re.MULTILINE):
        plain = re.sub(r"[^\w\- ]", "", heading.replace("`", "").lower()).replace(" ", "-")
        found[plain] = found.get(plain, -1) + 1
    return {name if not i else f"{name}-{i}" for name, count in found.items() for i in range(count + 1)}


def broken(page, text):
    """Links of a page that lead nowhere."""
    targets = re.findall(r"\]\(([^()\s]+)\)", text)
    for target in targets:
        if target.startswith(("http://", "https://")):
            continue
        path, _, anchor = target.partition("#")
        place = (page.parent / path).resolve() if path else page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            yield target


@pytest.mark.parametrize("name", NAMES)
def test_links_lead_somewhere(name):
    # a link's text may be code, its target is not
    text = re.sub(r"\[[^\]\n]*\](?=\()", "[text]", BLOCK.sub("", text_of(name)))
    assert list(broken(ROOT / name, text)) == []


def test_a_broken_link_would_be_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# One\n## One two\n[a](#one) [b](#one-two) [c](#three) [d](page.md#one) [e](none.md) [f](x/y.py#z)"
    )
    assert list(broken(page, page.read_text())) == ["#three", "none.md", "x/y.py#z"]


@pytest.mark.parametrize("name", NAMES)
def test_the_site_has_what_is_linked(name):
    for target in re.findall(r"\]\((?!https?:)([\w./]+)", BLOCK.sub("", text_of(name))):
        place = ((ROOT / name).parent / target).resolve().relative_to(ROOT)
        assert any(place.is_relative_to(part) for part in make_docs.COPIED), target


def test_every_page_is_linked_from_the_first_one():
    linked = set(re.findall(r"\]\(([\w./]+\.md)", text_of("docs/index.md")))
    pages = {page.relative_to(ROOT / "docs").as_posix() for page in PAGES if page.is_relative_to(ROOT / "docs")}
    assert pages - linked == {"index.md"}
    assert "docs/index.md" in text_of("README.md")


# -- Python ----------------------------------------------------------------------------------------------------------


def imports(code):
    """Modules, and names of modules, that a block imports."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module, alias.name) for alias in node.names)


def needs_ros(code):
    return any(module.split(".")[0] in ROS for module, _ in imports(code))


@pytest.mark.parametrize("name", [name for name in NAMES if blocks(name, "python")])
def test_what_python_blocks_import_exists(name):
    for code in blocks(name, "python"):
        compile(code, name, "exec")
        for module, item in imports(code):
            loaded = importlib.import_module(module)
            assert item is None or hasattr(loaded, item) or importlib.util.find_spec(f"{module}.{item}"), (module, item)


@pytest.mark.parametrize("name", [name for name in NAMES if blocks(name, "python") and name not in TRIED_ELSEWHERE])
def test_python_blocks_run_one_after_the_other(name, tmp_path, monkeypatch):
    for folder in ("bags", "test"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    codes = [code for code in blocks(name, "python") if not needs_ros(code)]
    names, printed = {}, io.StringIO()
    with contextlib.redirect_stdout(printed):
        for code in codes:
            exec(compile(code, name, "exec"), names)
    assert not codes or printed.getvalue()
    assert "nan" not in printed.getvalue()


# -- command lines ---------------------------------------------------------------------------------------------------

EXECUTABLES = reference.executables()
OWN = {"build", "test", "shell", "python"}


def command_lines(name):
    """Calls of ./run and of ros2 run sbs_sim, in blocks and in code within the text, as lists of words."""
    text = text_of(name)
    lines = [line for kind, body in BLOCK.findall(text) if kind != "python" for line in body.splitlines()]
    lines += [" ".join(code.split()) for code in re.findall(r"(?<!`)`([^`]+)`(?!`)", BLOCK.sub("", text))]
    for line in lines:
        call = re.match(r"\s*(?:\./run|ros2 run sbs_sim) (.+)", line)
        if call and "<" not in call[1] and "..." not in call[1]:
            yield shlex.split(call[1], comments=True)


def check_ros_arguments(name, words):
    """Complain about parameters that a node does not have, and values out of range."""
    node = {"cockpit": "simulator"}.get(name, name)
    parameters = importlib.import_module(f"sbs_sim.nodes.{node}").PARAMETERS
    for word in (after for before, after in itertools.pairwise(words) if before == "-p"):
        key, _, text = word.partition(":=")
        value = YAML(typ="safe", pure=True).load(text)
        assert key in parameters, f"{name} has no parameter {key}"
        parameter = parameters[key]
        assert isinstance(value, type(parameter.default)) or (parameter.default == "" and value is False), word
        assert parameter.least is None or parameter.least <= value <= parameter.most, word


def check(words):
    """Complain about a command line that the executable would not take."""
    name, *arguments = words
    if name in OWN:
        files = [word for word in arguments if word.endswith((".py", ".txt")) and "/" in word]
        assert [file for file in files if not (ROOT / file).exists()] == []
        return
    assert name in EXECUTABLES or name in {"--help", "NAME"}, f"no executable {name}"
    place = arguments.index("--ros-args") if "--ros-args" in arguments else len(arguments)
    if arguments[place:]:
        check_ros_arguments(name, arguments[place:])
    if name not in EXECUTABLES:
        return
    parser = reference.parser_of(EXECUTABLES[name])
    own = arguments[:place]
    if parser is None:
        assert own == []
    elif own and "--help" not in own:
        try:
            parser.parse_intermixed_args(own)
        except SystemExit:
            pytest.fail(f"{name} {own}: {parser.format_usage()}")


@pytest.mark.parametrize("name", NAMES)
def test_command_lines_are_right(name):
    for words in command_lines(name):
        check(words)


def test_there_are_command_lines():
    assert len([words for name in NAMES for words in command_lines(name)]) > 100


@pytest.mark.parametrize(
    "line",
    ["trim --speed 5", "trim --airspeed fast", "tirm", "simulator --ros-args -p speed:=1.0", "python tools/none.py"]
    + ["simulator --ros-args -p airspeed:=1000.0", "simulator --fast", "plot"],
)
def test_a_wrong_command_line_would_be_found(line):
    with pytest.raises((AssertionError, pytest.fail.Exception)):
        check([*shlex.split(line), *(["--out"] if line == "plot" else [])])


def test_calls_of_services_have_the_fields():
    count = 0
    for name in NAMES:
        for kind, body in re.findall(r"sbs_msgs/(?:srv|action)/(\w+) \"(\{.*\})\"", text_of(name)):
            (path,) = (ROOT / "msg_defs").glob(f"*/{kind}.*")
            fields = {entry.name for entry in reference.parts_of(path)[0].entries}
            assert set(YAML(typ="safe", pure=True).load(body)) - fields == set(), body
            count += 1
    assert count >= 8


# -- the site --------------------------------------------------------------------------------------------------------


def test_what_the_site_adds_to_the_pages(tmp_path):
    (tmp_path / "docs").mkdir()
    for name in ("docs/index.md", "docs/reference/api.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text_of(name))
    make_docs.add_modules(tmp_path)
    make_docs.add_contents(tmp_path)
    api = (tmp_path / "docs" / "reference" / "api.md").read_text()
    index = (tmp_path / "docs" / "index.md").read_text()
    made = sorted(page.stem for page in (tmp_path / "docs" / "reference" / "api").glob("*.rst"))
    assert "../../sbs_sim" not in api
    assert len(made) > 40
    assert all(f"(api/{name}.rst)" in api and importlib.util.find_spec(name) for name in made)
    listed = re.findall(r"^\w[\w :,\"-]* <([\w./]+\.md)>$", index, re.MULTILINE)
    assert len(listed) == len(set(listed))
    assert {
        "../README.md",
        "../CHANGELOG.md",
        "tutorial.md",
        "theory.md",
        "howto/wind.md",
        "reference/topics.md",
    } < set(listed)
    assert index.count(":caption: ") == 2


def test_a_missing_generator_is_reported_in_one_line(tmp_path):
    (tmp_path / "tools").mkdir()
    script = tmp_path / "tools" / "make_docs.py"
    script.write_text((ROOT / "tools" / "make_docs.py").read_text())
    result = subprocess.run(
        [sys.executable, script, "--out", tmp_path / "site"], capture_output=True, text=True, timeout=60, check=False
    )
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.count("\n") == 1
    requirements = re.search(r"./run python -m pip install \S+ --target \S+ -r (\S+)$", result.stderr.strip())
    assert (ROOT / requirements[1]).exists()
    assert requirements[0] in (ROOT / requirements[1]).read_text()
    assert not (tmp_path / "site").exists()
