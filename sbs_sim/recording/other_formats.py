"""Files and folders that are not an MCAP log: what they are, and how to make a log of them."""

from pathlib import Path

PACKED = {b"\x28\xb5\x2f\xfd": "zstd -d", b"\x1f\x8b\x08": "gunzip -k", b"\x04\x22\x4d\x18": "lz4 -d"}
TO_MCAP = (
    "`rosbags-convert --src {} --dst NEW --dst-storage mcap` of the Python package rosbags makes one in MCAP of it"
)
MAX_LISTED = 3  # that are listed


def describe_folder(path: Path) -> str:
    """What to do with a folder where a log is wanted; rosbag2 makes one for each bag."""
    found = {suffix: sorted(path.glob(f"*{suffix}")) for suffix in (".mcap", ".mcap.zstd", ".db3", ".db3.zstd")}
    if logs := found[".mcap"]:
        more = ", ..." if len(logs) > MAX_LISTED else ""
        return f"a folder, name the log in it: {', '.join(map(str, logs[:MAX_LISTED]))}{more}"
    if packed := found[".mcap.zstd"]:
        return f"a folder whose log is compressed as a whole: `zstd -d {packed[0]}` unpacks it"
    if found[".db3"] or found[".db3.zstd"]:
        return f"a folder with a bag in SQLite: {TO_MCAP.format(path)}"
    return "a folder without a log (.mcap)"


def describe_file(path: Path, head: bytes) -> str:
    """What a file is by its first bytes, and what to do with it, if it is of a known kind that is not MCAP."""
    if head.startswith(b"SQLite format 3\0"):
        return f"a bag in SQLite: {TO_MCAP.format(path.parent)}"
    if head.startswith(b"#ROSBAG V"):
        return f"a bag of ROS 1: {TO_MCAP.format(path)}"
    if b"rosbag2_bagfile_information" in head:
        return f"the description of a bag, which is {describe_folder(path.parent)}"
    for magic, command in PACKED.items():
        if head.startswith(magic):
            return f"compressed as a whole: `{command} {path}` unpacks it"
    return ""
