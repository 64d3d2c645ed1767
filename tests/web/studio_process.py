"""A studio in a process of its own, as a user starts it."""

import json
import os
import subprocess
import sys


def start_studio(folder, *words, more=False):
    """A studio whose homes are a folder: its process, the link that it says, and with `more` all that it says."""
    homes = {f"XDG_{kind}_HOME": str(folder) for kind in ("CONFIG", "DATA", "STATE")}
    command = [sys.executable, "-m", "handout", "studio", "--no-browser", "--json", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, **homes})
    told = json.loads(process.stdout.readline())
    return (process, told["link"], told) if more else (process, told["link"])
