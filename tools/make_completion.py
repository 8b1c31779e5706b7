"""Write config/completion.bash anew: completion of executables, options, parameters and paths in bash.

    ./run python tools/make_completion.py

takes them from setup.py, the command lines, the parameters that the nodes declare, and the schema of aircraft files.
The file has all of it in itself, so that completing starts no Python.
"""

import argparse
import importlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import update_reference as reference

from sbs_sim.commands.sweep import TYPED
from sbs_sim.model.state import CONTROL_NAMES

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "config" / "completion.bash"
OWN = ("build", "test", "shell", "python", "completion", "--help", "--version")  # of ./run
FILES, PATHS, ASSIGNED, AIRCRAFT = "@files", "@paths", "@assigned", "@aircraft"
KINDS = {
    "FILE": FILES,
    "NAME|FILE": FILES,
    "DIR": FILES,
    "FOLDER": FILES,
    "PATH=VALUE": ASSIGNED,
    "PATH=SHARE": ASSIGNED,
    "NAME": AIRCRAFT,
}

HEAD = """# Completion for bash: source this file, or evaluate what `./run completion` or `sbs-sim completion` prints.
# Made by tools/make_completion.py: do not edit.
# shellcheck shell=bash disable=SC2207  # no completion has blanks in it
"""
FUNCTIONS = """
_sbs_sim_words() {
    COMPREPLY=($(compgen -W "$1" -- "$2"))
}

# What may follow an option, or be the first argument: words, or what a mark represents.
_sbs_sim_value() {
    local word=$2
    case $1 in
        @files) compopt -o default ;;
        @aircraft) compopt -o default; _sbs_sim_words "$_sbs_sim_aircraft" "$word" ;;
        @paths) _sbs_sim_words "$_sbs_sim_conditions $_sbs_sim_paths" "$word" ;;
        @assigned) compopt -o nospace; _sbs_sim_words "${_sbs_sim_paths// /= }=" "$word" ;;
        *) _sbs_sim_words "$1" "$word" ;;
    esac
}

# Completes the arguments of executable $1, whose name is word $2 of the line.
_sbs_sim_arguments() {
    local name=$1 place=$2 word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} ros='' i
    [[ $before == '=' ]] && before=${COMP_WORDS[COMP_CWORD - 2]}
    [[ $word == '=' ]] && word=''
    for ((i = place + 1; i < COMP_CWORD; i++)); do
        [[ ${COMP_WORDS[i]} == --ros-args ]] && ros=yes
    done
    if [[ -n $ros && ($before == -p || $before == --param) ]]; then
        compopt -o nospace
        _sbs_sim_words "$(_sbs_sim_parameters "$name")" "$word"
    elif [[ -n $ros ]]; then
        _sbs_sim_words '-p -r --params-file --log-level' "$word"
    elif [[ -n $(_sbs_sim_follows "$name $before") ]]; then
        _sbs_sim_value "$(_sbs_sim_follows "$name $before")" "$word"
    elif [[ $word == -* ]]; then
        _sbs_sim_words "$(_sbs_sim_options "$name")" "$word"
    elif [[ -n $(_sbs_sim_follows "$name") ]]; then
        _sbs_sim_value "$(_sbs_sim_follows "$name")" "$word"
    fi
}

_sbs_sim() {
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        _sbs_sim_words "$_sbs_sim_names completion --help --version" "${COMP_WORDS[1]}"
    else
        _sbs_sim_arguments "${COMP_WORDS[1]}" 1
    fi
}

# ./run of any clone; other programs of that name are left to what bash does without this.
_sbs_sim_run() {
    local script
    COMPREPLY=()
    script=$(readlink -f -- "${COMP_WORDS[0]}" 2>/dev/null)
    if [[ ! -r ${script%/*}/config/completion.bash || ${COMP_WORDS[0]} != */* ]]; then
        compopt -o default
    elif ((COMP_CWORD == 1)); then
        _sbs_sim_words "$_sbs_sim_names $_sbs_sim_own" "${COMP_WORDS[1]}"
    else
        case ${COMP_WORDS[1]} in
            test | shell | python) compopt -o default ;;
            *) _sbs_sim_arguments "${COMP_WORDS[1]}" 1 ;;
        esac
    fi
}

complete -F _sbs_sim sbs-sim
complete -F _sbs_sim_run run
"""


def paths(schema: dict[str, Any], path: str = "") -> Iterator[str]:
    """Paths of all values of an aircraft file, those of rotors of every rotor."""
    if "properties" in schema:
        for key, part in schema["properties"].items():
            yield from paths(part, f"{path}.{key}".lstrip("."))
    elif path in ("body.surfaces", "body.fuselage", "drives", "rotors.schedule"):  # there are some or none
        yield path
    elif path == "controls":  # the names are the file's: those of the aircraft in the repository
        yield from (f"{path}.{name}.range_deg" for name in CONTROL_NAMES)
    elif "properties" in schema.get("items", {}):
        yield from paths(schema["items"], path)
    elif path not in ("name", "description"):
        yield path


def follows(parser: argparse.ArgumentParser, name: str) -> Iterator[tuple[str, str]]:
    """What may follow the options of an executable, and what may be its first argument."""
    for action in parser._actions:
        if action.help == argparse.SUPPRESS or action.nargs == 0:
            continue
        kind = " ".join(map(str, action.choices)) if action.choices else KINDS.get(str(action.metavar), "")
        for option in action.option_strings:
            if kind:
                yield f"{name} {option}", kind
        if not action.option_strings and action.dest in ("file", "parameter"):
            yield name, FILES if action.dest == "file" else PATHS


def options(parser: argparse.ArgumentParser | None) -> str:
    """Options of an executable."""
    if parser is None:
        return "--help --version --ros-args"
    shown = [action for action in parser._actions if action.help != argparse.SUPPRESS]
    return " ".join(option for action in shown for option in action.option_strings if option.startswith("--"))


def function(name: str, cases: dict[str, str]) -> str:
    """A function of bash that prints the words of a case; cases with the same words share them."""
    by_words: dict[str, list[str]] = {}
    for case, words in cases.items():
        by_words.setdefault(words, []).append(f"'{case}'")
    lines = [f"        {' | '.join(keys)}) echo '{words}' ;;" for words, keys in by_words.items()]
    return "\n".join([f"{name}() {{", "    case $1 in", *lines, "    esac", "}"])


def text() -> str:
    """The complete file."""
    modules = reference.executables()
    parsers = {name: reference.parser_of(module) for name, module in modules.items()}
    known = {name: getattr(importlib.import_module(module), "PARAMETERS", {}) for name, module in modules.items()}
    known["cockpit"] = known["simulator"]  # what follows --ros-args is the simulator's
    schema = json.loads((ROOT / "config" / "aircraft.schema.json").read_text(encoding="utf-8"))
    aircraft = sorted(path.stem for path in (ROOT / "config" / "aircraft").glob("*.yaml"))
    values = {
        "names": " ".join(modules),
        "own": " ".join(OWN),
        "aircraft": " ".join(aircraft),
        "conditions": " ".join(TYPED),
        "paths": " ".join(paths(schema)),
    }
    following = [item for name, parser in parsers.items() if parser for item in follows(parser, name)]
    return "\n".join(
        [
            HEAD,
            *(f"_sbs_sim_{name}='{words}'" for name, words in values.items()),
            "",
            function("_sbs_sim_options", {name: options(parser) for name, parser in parsers.items()}),
            "",
            function("_sbs_sim_follows", dict(following)),
            "",
            function(
                "_sbs_sim_parameters",
                {name: " ".join(f"{key}:=" for key in keys) for name, keys in known.items() if keys},
            ),
            FUNCTIONS.rstrip("\n"),
            "",
        ]
    )


def main() -> None:
    """Write the file."""
    TARGET.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    main()
