"""Who can reach a running simulator, and what it can be made to do with files."""

import contextlib
import json
import os
import re
import socket
import subprocess
import sys
import zipfile
from pathlib import Path

import psutil
import pytest

rclpy = pytest.importorskip("rclpy")

from ros_harness import DOMAINS, EXECUTABLES, environment, world  # noqa: E402

from sbs_msgs.msg import BodyState  # noqa: E402

IS_OLD_DDS = "/libfastrtps.so" in Path("/proc/self/maps").read_text()
ROOT = Path(__file__).resolve().parents[2]
READ_BY_DDS = "FASTRTPS_DEFAULT_PROFILES_FILE" if IS_OLD_DDS else "FASTDDS_DEFAULT_PROFILES_FILE"
YAML_LOADERS = re.compile(r"YAML\((?P<arguments>[^)]*)\)")


def test_nothing_listens_beyond_loopback(tmp_path):
    """Nor does it share memory with others, of which a killed one would leave behind what ends the rest."""
    with world(next(DOMAINS), tmp_path) as made:
        process = made.start("simulator")
        made.client.watch("state", BodyState)
        made.client.next("state")
        sockets = psutil.Process(process.pid).net_connections(kind="inet")
        assert [s.laddr.ip for s in sockets if s.type == socket.SOCK_DGRAM].count("127.0.0.1") >= 2
        assert {s.laddr.ip for s in sockets} == {"127.0.0.1"}
        assert [s for s in sockets if s.status == psutil.CONN_LISTEN] == []
        assert "/dev/shm/fastrtps" not in Path(f"/proc/{process.pid}/maps").read_text()


def run_alone(*arguments, **changes):
    """A Python where there is no network at all."""
    own = {key: value for key, value in environment(next(DOMAINS)).items() if "PROFILES_FILE" not in key}
    command = ["unshare", "--map-root-user", "--net", sys.executable, *arguments]
    return subprocess.run(command, env={**own, **changes}, capture_output=True, text=True, timeout=60, check=False)


def test_a_profile_that_dds_does_not_take_ends_the_start():
    """As if a release of Fast DDS read it from another variable: nothing is open to the network for long."""
    wrong = READ_BY_DDS.replace("RTPS", "DDS") if IS_OLD_DDS else READ_BY_DDS.replace("DDS", "RTPS", 1)
    changes = {wrong: str(ROOT / "config" / "loopback.xml"), "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}
    if run_alone("-c", "").returncode:
        pytest.skip("this machine gives processes no network of their own")
    ended = run_alone(str(EXECUTABLES / "control_mixer"), **changes)
    assert ended.returncode == 1, ended.stderr
    reported = ended.stderr.splitlines()[-1]
    assert re.match(r"DDS listens on 0\.0\.0\.0 port \d+", reported)
    assert "loopback.xml" in reported
    assert "Traceback" not in ended.stderr


def test_only_sockets_that_others_reach_count():
    from sbs_sim.nodes.confinement import listening_beyond

    before = listening_beyond()
    with contextlib.ExitStack() as stack:
        for family, address in ((socket.AF_INET, "127.0.0.2"), (socket.AF_INET6, "::1"), (socket.AF_INET, "0.0.0.0")):
            made = stack.enter_context(socket.socket(family, socket.SOCK_DGRAM))
            made.bind((address, 0))
        assert set(listening_beyond()) - set(before) == {f"0.0.0.0 port {made.getsockname()[1]}"}
    assert listening_beyond() == before


def test_who_else_takes_part_in_a_domain_is_known_at_once():
    """By the port where he listens, before he is discovered; what cannot be known counts as company."""
    domain = next(DOMAINS)
    code = """
import rclpy
from sbs_sim.nodes import confinement
confinement.keep_to_this_machine()
domain = int(__import__("os").environ["ROS_DOMAIN_ID"])
print(confinement.alone_in_domain(domain), end=" ")
rclpy.init()
node = rclpy.create_node("here")
print(confinement.alone_in_domain(domain), confinement.alone_in_domain(domain + 1))
"""
    own = {key: value for key, value in environment(domain).items() if "PROFILES_FILE" not in key}

    def reported(reach):
        changes = {**own, "ROS_AUTOMATIC_DISCOVERY_RANGE": reach}
        ended = subprocess.run([sys.executable, "-c", code], env=changes, capture_output=True, text=True, check=True)
        return ended.stdout.strip()

    assert reported("LOCALHOST") == "False True False"
    assert reported("SUBNET") == "False False False"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        # DDSI-RTPS: port 7400 + 250 domain + 10 + 2 participant for what participants tell of themselves
        other.bind(("127.0.0.1", 7400 + 250 * domain + 10 + 2 * 17))
        assert reported("LOCALHOST") == "False False False"


def test_the_user_has_the_last_word_on_the_network(tmp_path):
    """A profile of one's own is taken: here one that gives the participant a name."""
    profile = tmp_path / "own.xml"
    text = (ROOT / "config" / "loopback.xml").read_text()
    profile.write_text(text.replace("<rtps>", "<rtps><name>/own_name</name>"))
    names = (READ_BY_DDS, "ROS_AUTOMATIC_DISCOVERY_RANGE")
    code = "from sbs_sim.nodes import confinement; confinement.keep_to_this_machine()"
    code += f"; import os; print(*map(os.environ.get, {names}))"
    own = {**environment(next(DOMAINS)), names[0]: str(profile), names[1]: "LOCALHOST"}
    ended = subprocess.run([sys.executable, "-c", code], env=own, capture_output=True, text=True, check=True)
    assert ended.stdout.split() == [str(profile), "LOCALHOST"]


def test_where_ros_is_for_the_network_nothing_is_changed():
    code = "from sbs_sim.nodes import confinement; confinement.keep_to_this_machine()"
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    code += f"; import os; print('{READ_BY_DDS}' in os.environ, os.environ['{name}'])"
    own = {key: value for key, value in environment(1).items() if "PROFILES_FILE" not in key}
    for wanted, there in (("SUBNET", "False SUBNET"), ("LOCALHOST", "True SYSTEM_DEFAULT")):
        command = [sys.executable, "-c", code]
        ended = subprocess.run(command, env={**own, name: wanted}, capture_output=True, text=True, check=True)
        assert ended.stdout.strip() == there


def test_security_that_is_not_there_is_not_taken_for_granted(tmp_path):
    """With SROS 2 switched on, and a Fast DDS that was built without it, no node starts unprotected."""
    asked = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce", "ROS_SECURITY_KEYSTORE": str(tmp_path)}
    command = [sys.executable, str(EXECUTABLES / "control_mixer")]
    ended = subprocess.run(
        command, env={**environment(next(DOMAINS)), **asked}, capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 1
    assert "Traceback" not in ended.stderr
    assert "security" in ended.stderr.splitlines()[-1].lower()


WRONG_ROS_ARGUMENTS = [
    (["-p", "airspeed"], 2),
    (["--params-file", "none"], 2),
    (["-r", "__node:=9x"], 2),
    (["-r", "__ns:=a b"], 2),
    (["--log-level", "x"], 2),
    (["-p", "use_sim_time:=5"], 1),
]


@pytest.mark.parametrize(("arguments", "code"), WRONG_ROS_ARGUMENTS, ids=lambda item: str(item))
def test_wrong_arguments_for_ros_are_one_line(tmp_path, arguments, code):
    command = [sys.executable, EXECUTABLES / "simulator", "--ros-args", *arguments]
    own = environment(next(DOMAINS), tmp_path)
    ended = subprocess.run(command, env=own, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == code
    lines = [line for line in ended.stderr.strip().splitlines() if "[rcl]" not in line]  # ROS has its own
    assert len(lines) == 1, lines


def test_yaml_is_loaded_safely_everywhere():
    """Every loader of the package is ruamel's safe one, and nothing else makes objects of data.

    But for the calls that go to a worker of dask and back: whoever reaches such a cluster may execute anything there.
    """
    for path in (ROOT / "sbs_sim").rglob("*.py"):
        text = path.read_text()
        if path.name == "cluster.py":
            text = text.replace("import pickle", "")
        for found in YAML_LOADERS.finditer(text):
            only_writes = ".load(" not in text  # with comments, which the safe kind cannot write
            assert only_writes or 'typ="safe"' in found["arguments"], path
        for name in (
            "import pickle",
            "import marshal",
            "import shelve",
            "eval(",
            "exec(",
            "os.system",
            "shell=True",
            "yaml.load(",
        ):
            assert name not in text.replace("yaml.load(text) or []", ""), f"{path} has {name}"


def test_temporary_files_are_of_the_user_alone(tmp_path, monkeypatch):
    """What a log brings along lies in a folder that nobody else can read or exchange."""
    import tempfile

    import fuzz_targets

    from sbs_sim.recording import read
    from sbs_sim.recording.recorded_flight import flight_of

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "a.mcap").write_bytes(fuzz_targets.SMALL_LOG)
    flight = flight_of(read(tmp_path / "a.mcap"))
    assert os.stat(flight.folder.name).st_mode & 0o077 == 0


# --- what is installed ----------------------------------------------------------------------------------------------

PIN = re.compile(
    r"^(?P<pin>[\w.-]+==[\w.]+)(?P<marker> ; [^\\\n]*)?(?P<hashes>( \\\n    --hash=sha256:[0-9a-f]{64})*)$", re.M
)


def plain_pin(pin):
    return re.sub(r"[-_.]+", "-", pin.split("==")[0]).lower() + "==" + pin.split("==")[1]


@pytest.mark.parametrize("name", ["bootstrap", "runtime", "test", "ros-jazzy", "ros-kilted"])
def test_everything_is_installed_by_its_hash(name):
    wanted = [line for line in (ROOT / "requirements" / f"{name}.txt").read_text().splitlines() if "==" in line]
    locked = list(PIN.finditer((ROOT / "requirements" / f"{name}.lock").read_text()))
    pins = sorted(plain_pin(found["pin"]) for found in locked)
    assert pins == sorted(plain_pin(line.split(" ;")[0]) for line in wanted)
    assert all(found["hashes"] for found in locked)
    installed = re.sub(r"^ros-.*", "ros-$wheels", name)
    assert re.search(rf'-r "?requirements/{re.escape(installed)}\.lock', (ROOT / "run").read_text())


ADVISORIES = {
    "A-1": {"package": "NumPy", "ranges": [[{"introduced": "0"}, {"fixed": "999"}]]},
    "A-2": {"package": "numpy", "ranges": [[{"introduced": "0"}, {"fixed": "1.0"}]]},
    "A-3": {"package": "scipy", "ranges": [[{"introduced": "0"}, {"last_affected": "0.1"}, {"introduced": "999"}]]},
    "A-4": {"package": "not_ours", "ranges": [[{"introduced": "0"}]]},
    "A-5": {"package": "mpmath", "versions": ["1.3.0"]},
    "A-6": {"package": "mpmath", "versions": ["1.3.0"], "withdrawn": "2026-01-01T00:00:00Z"},
}


def database(folder, names):
    path = folder / "all.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            entry = ADVISORIES[name]
            ranges = [{"type": "ECOSYSTEM", "events": events} for events in entry.get("ranges", [])]
            affected = {"package": {"name": entry["package"]}, "ranges": ranges, "versions": entry.get("versions", [])}
            advisory = {"id": name, "affected": [affected]}
            if "withdrawn" in entry:
                advisory["withdrawn"] = entry["withdrawn"]
            archive.writestr(f"{name}.json", json.dumps(advisory))
    return path


def check(*arguments):
    command = [sys.executable, str(ROOT / "tools" / "check_vulnerabilities.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_known_vulnerabilities_are_found_without_network(tmp_path):
    ended = check("--database", database(tmp_path, ADVISORIES))
    assert ended.returncode == 1
    numpy, mpmath, total = sorted(
        ended.stdout.splitlines(), key=lambda line: "packages" in line or ("mpmath" in line) / 2
    )
    assert re.fullmatch(r"numpy [\d.]+: A-1 \(mended in 999\)", numpy)
    assert mpmath == "mpmath 1.3.0: A-5"
    assert total.endswith(" packages, 2 with known vulnerabilities")
    assert check("--database", database(tmp_path, ["A-2", "A-3", "A-4", "A-6"])).returncode == 0


def test_what_could_not_be_compared_is_not_called_sound(tmp_path):
    ended = check("--database", tmp_path / "nothing.zip")
    assert ended.returncode == 2
    assert ended.stderr.startswith("nothing was compared: ")
