#!/usr/bin/env bash
# A Ctrl-C while numba compiles or loads a function can vanish: llvmlite calls Python back, where no exception can leave.
#
# LLVM tells llvmlite of every finished object through two functions of ctypes, ExecutionEngine._raw_object_cache_notify and
# _raw_object_cache_getbuffer. If the signal arrives while LLVM works, Python raises KeyboardInterrupt at the first instruction
# that it executes afterwards, which is in them. ctypes prints "Exception ignored" and the program goes on, for hours if the call
# takes hours. Functions that are cached on disk are told of too. On a busy machine it met two of thirty starts that were
# interrupted within a second. Who wants his Ctrl-C keeps it from these frames, with a handler that
# looks at the stack and raises after the call.
#
# Seen with numba 0.68.1 and llvmlite 0.50.0: the output below; exit status 0 while it is so. The signal is raised at the place.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf -- "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 llvmlite==0.50.0
cat >"$folder/interrupt.py" <<'PYTHON'
import signal
import sys

import numba


def once(frame, event, _):
    if event == "call" and frame.f_code.co_name.startswith("_raw_object_cache"):
        sys.setprofile(None)
        print("SIGINT in", frame.f_code.co_name)
        signal.raise_signal(signal.SIGINT)


sys.unraisablehook = lambda what: print("ignored:", what.exc_type.__name__)
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.setprofile(once)
try:
    print("the call returns", numba.njit(lambda x: x + 1)(1))
except KeyboardInterrupt:
    print("interrupted")
PYTHON
"$folder/venv/bin/python" "$folder/interrupt.py" | tee "$folder/seen"
diff - "$folder/seen" <<'SEEN'
SIGINT in _raw_object_cache_getbuffer
ignored: KeyboardInterrupt
the call returns 2
SEEN
