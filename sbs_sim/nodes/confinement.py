"""Keeps DDS on this machine where discovery is for this machine only, and looks whether that has worked."""

import contextlib
import ipaddress
import os
from collections.abc import Iterator
from pathlib import Path

import rclpy.utilities

from sbs_sim.config_file import config_folder
from sbs_sim.errors import SbsError

# Where Fast DDS finds its profile. Version 2 (until Jazzy) knows the old name alone, version 3 (from Kilted on) the new
# one, and ROS complains there of the old one.
OLD_PROFILES, PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
OLD_LIBRARY = "/libfastrtps.so"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
# PB and DG among the default port numbers of the wire protocol DDSI-RTPS: where those of domain 0 begin, and how many
# belong to each domain.
FIRST_PORT, PORTS = 7400, 250
IPAddress = ipaddress.IPv4Address | ipaddress.IPv6Address
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
    own, found = _own_sockets(), []
    for address, port, inode in _listening():
        if inode in own and not address.is_loopback:
            found.append(f"{address} port {port}")
    return found


def alone_in_domain(domain: int) -> bool:
    """True if no other process of this machine takes part in a domain of ROS, and others could not either.

    Where config/loopback.xml keeps DDS in, all who can be discovered listen at ports of the domain on this machine. The
    kernel knows these at once, discovery finds who is behind them after a while.
    """
    keeps_in = os.environ.get(RANGE) == "SYSTEM_DEFAULT" and any(map(_is_ours, (OLD_PROFILES, PROFILES)))
    if not keeps_in or not rclpy.utilities.get_rmw_implementation_identifier().startswith("rmw_fastrtps"):
        return False
    own, ports = _own_sockets(), range(FIRST_PORT + PORTS * domain, FIRST_PORT + PORTS * (domain + 1))
    listening = [(port, inode) for _, port, inode in _listening() if port in ports]
    # those of this process must be seen, or the kernel does not show it
    return bool(listening) and all(inode in own for _, inode in listening)


def _own_sockets() -> set[str]:
    """Inodes of the sockets of this process."""
    own = set()
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # closed meanwhile
            kind, _, inode = os.readlink(f"/proc/self/fd/{number}").partition(":")
            if kind == "socket":
                own.add(inode.strip("[]"))
    return own


def _listening() -> Iterator[tuple[IPAddress, int, str]]:
    """Address, port and inode of every UDP socket that hears everybody."""
    for table in ("/proc/self/net/udp", "/proc/self/net/udp6"):
        for line in Path(table).read_text().splitlines()[1:] if Path(table).exists() else ():
            _, local, _, state, *_, inode = line.split()[:10]
            if state == UNCONNECTED:
                yield *_address(local), inode


def _address(text: str) -> tuple[IPAddress, int]:
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
