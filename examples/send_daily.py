"""A day's letters, sent by a program: what a shop runs each night for the orders of its table.

    handout studio --no-browser --port 7217 --key-file studio.key &
    python examples/send_daily.py people.csv --day 2026-03-01 --test      # proofs all of it, and sends nothing
    python examples/send_daily.py people.csv --day 2026-03-01             # sends it; run twice, it is sent once

The table is a batch with the day as its key, so that a program that was cut off asks again, and nothing is made twice.
Rows that cannot be made, and those that a person should see, are left out and told.  The studio tells how it ended at
an address of this program, signed; the program does not wait for its own request, and may hear the same twice.
"""

from __future__ import annotations

import argparse
import hmac
import json
import secrets
import sys
import time
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

LETTER = "Dear {{ first_name }},\n\nthank you for your order: each piece is made by hand, and so is this note.\n\nMarie"
OLDEST = 300  # s: news that were signed longer ago are somebody's copy


class Studio:
    """A studio that runs on this computer, asked with the key of its --key-file."""

    def __init__(self, address: str, key: str) -> None:
        self.address, self.key = address.rstrip("/"), key

    def ask(self, method: str, path: str, body: Any = None, **headers: str) -> Any:
        """What it answers; RuntimeError with its own sentence where it refuses."""
        data = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        own = {"Authorization": f"Bearer {self.key}", "Content-Type": "application/json", **headers}
        try:
            with urllib.request.urlopen(
                urllib.request.Request(self.address + path, data, own, method=method)
            ) as answer:
                return json.load(answer)
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["error"]) from error


class Ear(HTTPServer):
    """Listens at a port of this computer for what the studio tells, and believes what is signed with its secret."""

    def __init__(self, secret: str, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Heard)
        self.secret, self.news, self.timeout = secret, dict[str, Any](), 1.0

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/"

    def believes(self, text: bytes, signature: str) -> bool:
        """Whether a text was signed with the secret, and lately."""
        said = dict(part.partition("=")[::2] for part in signature.split(","))
        stamp = said.get("t", "")
        own = hmac.new(self.secret.encode(), f"{stamp}.".encode() + text, "sha256").hexdigest()
        fresh = stamp.isdecimal() and abs(time.time() - int(stamp)) < OLDEST
        return fresh and hmac.compare_digest(own, said.get("v1", ""))


class _Heard(BaseHTTPRequestHandler):
    server: Ear

    def do_POST(self) -> None:
        text = self.rfile.read(int(self.headers["Content-Length"]))
        believed = self.server.believes(text, self.headers.get("Handout-Signature", ""))
        if believed:
            self.server.news[self.headers["Handout-Id"]] = json.loads(text)  # the same twice is one
        self.send_response(204 if believed else 403)
        self.end_headers()

    def log_message(self, *said: object) -> None:
        """Nothing."""


def send(studio: Studio, table: Path, day: str, ear: Ear, how: dict[str, Any]) -> dict[str, Any]:
    """Send a day's letters, or go on with them; the batch as it is then, with the state of each row."""
    upload = studio.ask("POST", f"/api/uploads?name={table.name}", table.read_bytes())["id"]
    webhook = {"url": ear.address, "secret": ear.secret}
    asked = {"table": upload, "text": LETTER, "title": f"Orders of {day}", "key": day, "webhook": webhook, **how}
    batch = studio.ask("POST", "/api/batches", asked)
    one = f"/api/batches/{batch['batch']}"
    if batch["state"] == "new":
        studio.ask("POST", f"{one}/proof")
        batch = studio.ask("GET", one)
    if batch["state"] == "proofed":
        doubted = [row["row"] for row in batch["proof"]["look_at"]]
        approval = {"made": batch["proof"]["made"], "left_out": doubted}
        batch = studio.ask("POST", f"{one}/approval", approval)
    if batch["state"] in ("approved", "broken off"):
        studio.ask("POST", f"{one}/make", {}, Prefer="respond-async")
        while not any(news["batch"] == batch["batch"] for news in ear.news.values()):
            ear.handle_request()  # waits a second at most
    return studio.ask("GET", one)


def main() -> None:
    """Read the command line, send, and say what became of each row that is not done."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", type=Path)
    parser.add_argument("--day", default=time.strftime("%Y-%m-%d"))
    parser.add_argument("--test", action="store_true", help="make the proof, and send nothing")
    parser.add_argument("--studio", default="http://127.0.0.1:7217")
    parser.add_argument("--key-file", type=Path, default=Path("studio.key"))
    parser.add_argument("--secret-file", type=Path, default=Path("webhook.secret"), help="made where there is none")
    parser.add_argument("--port", type=int, default=7218, help="where it listens for the end")
    parser.add_argument(
        "--how", type=json.loads, default={"to": "pdf", "page": "A6", "hand": "house-joined", "seed": 4}
    )
    given = parser.parse_args()
    if not given.secret_file.exists():
        given.secret_file.touch(0o600)
        given.secret_file.write_text(secrets.token_urlsafe(32))
    key = f"test-{given.day}" if given.test else given.day
    studio = Studio(given.studio, given.key_file.read_text().strip())
    with Ear(given.secret_file.read_text(), given.port) as ear:
        batch = send(studio, given.table, key, ear, {**given.how, "test": given.test})
    print(f"{batch['title']}: {batch['state']}; {json.dumps(batch['states'])}")
    for row in batch["rows"]:
        if row["state"] not in ("done", "tested"):
            print(f"row {row['row']} ({row['called']}): {'; '.join([row['state'], *row['why']])}")
    sys.exit(0 if batch["state"] == "done" else 4)


if __name__ == "__main__":
    main()
