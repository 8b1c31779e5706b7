"""Keeps DDS on this machine where discovery is for this machine only, and looks whether that has worked."""

import ipaddress
import os
from pathlib import Path

import rclpy.utilities

from sbs_sim.aircraft import config_folder
from sbs_sim.errors import SbsError

# Where Fast DDS finds its profile. Version 2 (until Jazzy) knows the old name alone, version 3 (from Kilted on) the new
# one, and ROS complains there of the old one.
OLD_PROFILES, PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
OLD_LIBRARY = "/libfastrtps.so"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
UNCONNECTED = "07"  # state in /proc/net/udp of a socket that hears everybody


def keep_to_this_machine() -> None:
    """Have Fast DDS use 127.0.0.1 and nothing else where discovery is for this machine only: see config/loopback.xml.

    A profile of the user's own is left alone. To be called before ROS is started.
    """
    is_ours = rclpy.utilities.get_rmw_implementation_identifier().startswith("rmw_fastrtps")
    local = os.environ.get(RANGE) == "LOCALHOST"
    if local and is_ours and not any(map(os.environ.get, (OLD_PROFILES, PROFILES))):
        is_old = OLD_LIBRARY in Path("/proc/self/maps").read_text()
        os.environ[OLD_PROFILES if is_old else PROFILES] = str(_profile())
        os.environ[RANGE] = "SYSTEM_DEFAULT"  # what the profile says


def check_confinement() -> None:
    """Raise SbsError if this process listens beyond this machine though config/loopback.xml is to keep it in.

    Which variable names that file is up to the release of Fast DDS: one that reads neither would open the network
    without a word.
    """
    if os.environ.get(RANGE) != "SYSTEM_DEFAULT" or not any(map(_is_ours, (OLD_PROFILES, PROFILES))):
        return
    if beyond := listening_beyond():
        raise SbsError(
            f"DDS listens on {', '.join(beyond)}, not on this machine alone: it has not taken {_profile()};"
            f" {RANGE}=SUBNET allows the network"
        )


def listening_beyond() -> list[str]:
    """Addresses and ports at which UDP sockets of this process can be reached from other machines."""
    own = set()
    for number in os.listdir("/proc/self/fd"):
        try:
            own.add(os.readlink(f"/proc/self/fd/{number}"))
        except OSError:  # closed meanwhile
            continue
    found = []
    for table in ("/proc/self/net/udp", "/proc/self/net/udp6"):
        for line in Path(table).read_text().splitlines()[1:] if Path(table).exists() else ():
            _, local, _, state, *_, inode = line.split()[:10]
            address, port = _address(local)
            if state == UNCONNECTED and f"socket:[{inode}]" in own and not address.is_loopback:
                found.append(f"{address} port {port}")
    return found


def _address(text: str) -> tuple[ipaddress.IPv4Address | ipaddress.IPv6Address, int]:
    """Address and port as the kernel writes them: 32-bit words, each with its lowest byte first."""
    digits, port = text.split(":")
    words = (digits[i : i + 8] for i in range(0, len(digits), 8))
    address = ipaddress.ip_address(b"".join(bytes.fromhex(word)[::-1] for word in words))
    return getattr(address, "ipv4_mapped", None) or address, int(port, 16)


def _is_ours(variable: str) -> bool:
    """True if a variable names our profile, at whatever path a build has put it."""
    path = Path(os.environ.get(variable, ""))
    return path.is_file() and path.read_bytes() == _profile().read_bytes()


def _profile() -> Path:
    return config_folder() / "loopback.xml"
