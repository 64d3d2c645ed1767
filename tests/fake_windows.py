"""Runs verbs as on a system that is not POSIX: `python fake_windows.py '[["write", "hi", "-o", "a.svg"], …]'`.

What only POSIX has cannot be imported or called; a file that is open can be neither replaced, moved nor deleted;
folders cannot be opened; processes are spawned; text files without a named encoding are errors; the standard streams
are cp1252.  What the libraries do there is not tried.  The last line has the exit code of each verb.
"""

import contextlib
import fcntl
import importlib
import io
import json
import multiprocessing
import os
import shutil
import signal
import sys
import types
import warnings
from importlib.abc import MetaPathFinder
from pathlib import Path

# which look at the system when they are imported
_LIBRARIES = (
    "asyncio", "click._termui_impl", "cv2", "platformdirs", "rich.console", "scipy.optimize", "serial", "subprocess",
    "serial.tools.list_ports", "sklearn.ensemble",
)  # fmt: skip
_POSIX = {"fcntl", "termios", "tty", "pty", "pwd", "grp", "resource", "syslog"}
_CALLS = (
    "fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "getpgid", "setsid", "killpg", "mkfifo", "nice",
    "sync", "statvfs", "uname", "wait", "chown", "getloadavg", "sched_getaffinity", "posix_spawn", "initgroups",
)  # fmt: skip
_SIGNALS = ("SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGCHLD", "SIGPIPE", "SIGSTOP", "SIGTSTP")


class _Lacking(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name in _POSIX:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def _is_open(path):
    """Whether this process has a file open, or one in a folder."""
    place = os.path.realpath(path)
    for number in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):
            if f"{number.readlink()}/".startswith(f"{place}/"):
                return True
    return False


def _refusing(call, which):
    def refuse(*paths, **options):
        for path in paths[:which]:
            if "dir_fd" not in options and isinstance(path, str | Path) and _is_open(path):
                raise PermissionError(13, "It is being used by another process", str(path))
        return call(*paths, **options)

    return refuse


def _open(path, flags, mode=0o777, *, dir_fd=None, real=os.open):
    if dir_fd is None and Path(path).is_dir():
        raise PermissionError(13, "Permission denied", str(path))
    return real(path, flags, mode, dir_fd=dir_fd)


def _locking(number, _mode, many):
    fcntl.lockf(number, fcntl.LOCK_EX | fcntl.LOCK_NB, many, 0, os.SEEK_CUR)


def prepare():
    """Take away what POSIX has."""
    for name in _LIBRARIES:
        importlib.import_module(name)
    sys.meta_path.insert(0, _Lacking())
    for name in _POSIX:
        sys.modules.pop(name, None)
    for name in _CALLS:
        delattr(os, name)
    for name in _SIGNALS:
        delattr(signal, name)
    sys.modules["msvcrt"] = types.SimpleNamespace(locking=_locking, LK_NBLCK=2)
    shutil._use_fd_functions = False
    os.replace, os.rename = _refusing(os.replace, 2), _refusing(os.rename, 2)
    os.unlink = os.remove = _refusing(os.unlink, 1)
    os.open = _open
    multiprocessing.get_all_start_methods = lambda: ["spawn"]
    sys.platform = "win32"
    warnings.filterwarnings("ignore", category=EncodingWarning)
    warnings.filterwarnings("error", category=EncodingWarning, module=r"handout\.")
    for name, errors in (("stdout", "strict"), ("stderr", "backslashreplace")):
        stream = getattr(sys, name)
        setattr(sys, name, io.TextIOWrapper(stream.buffer, "cp1252", errors, line_buffering=True))


if __name__ == "__main__":
    prepare()
    from handout.cli import main

    codes = []
    for words in json.loads(sys.argv[1]):
        try:
            main(words)
        except SystemExit as leave:
            codes.append(leave.code)
    print(json.dumps(codes))
