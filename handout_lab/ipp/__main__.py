"""``python -m handout_lab.ipp FOLDER``: a simulated printer, to see what handout does when one fails."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from handout_lab.ipp.printer import FAILURES, Faults, SimulatedPrinter


def main() -> None:
    """Run a printer until Ctrl-C."""
    parser = argparse.ArgumentParser(prog="python -m handout_lab.ipp", description=Faults.__doc__)
    parser.add_argument("folder", type=Path, help="receives what is printed")
    parser.add_argument("--port", type=int, default=8632)
    jobs = ("busy", "empty_at", "jam_at", "hold_at", "lie_at", "lost_at", "torn_at", "restart_at", "unanswered_at")
    for name in (*jobs, "fail_at", "fail_for"):
        parser.add_argument(f"--{name.replace('_', '-')}", type=int, default=getattr(Faults, name))
    parser.add_argument("--fail-as", choices=FAILURES, default=Faults.fail_as)
    for name in ("cleared_after", "slow", "printing", "retry_after"):
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, default=getattr(Faults, name))
    for name in ("forgetful", "old", "no_envelopes", "simple"):
        parser.add_argument(f"--{name.replace('_', '-')}", action="store_true")
    settings = vars(parser.parse_args())
    folder, port = settings.pop("folder"), settings.pop("port")
    with SimulatedPrinter(folder, Faults(**settings), port) as printer:
        print(f"{printer.uri} prints into {folder}; stop it with Ctrl-C.", flush=True)
        try:
            while True:
                time.sleep(3600)
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
