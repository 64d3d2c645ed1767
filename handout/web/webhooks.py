"""Webhooks: how a batch ended is told to the program that wanted to know, signed, and again where it was not heard.

A webhook leads to this computer, or to a host that the studio was started with, so that nobody who may ask the studio
for letters can have it ask others for something.
"""

from __future__ import annotations

import asyncio
import hmac
import time
import urllib.request
from collections.abc import Collection
from http.client import HTTPException as BrokenAnswer
from typing import Any
from urllib.parse import urlsplit

from starlette.exceptions import HTTPException

from handout.web.studio import Studio
from handout.web.worker import Call
from handout.web.workers import Task

_HERE = frozenset({"localhost", "127.0.0.1", "::1"})
_AGAIN = (0.0, 1.0, 10.0, 60.0, 600.0)  # s before each try, own choice; what starts meanwhile, or later, tries as often
_PATIENCE = 10.0  # s that an answer may take; own choice


class _StayingHere(urllib.request.HTTPRedirectHandler):
    """Goes nowhere else than asked."""

    def redirect_request(self, *asked: Any) -> None:
        """None: the answer is an error then."""


# through no proxy: it would be asked for this computer's addresses
_OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}), _StayingHere)


def check_address(url: str, hosts: Collection[str]) -> str:
    """Why an address may not be told anything; "" where it may."""
    try:
        parts = urlsplit(url)
        host, _ = parts.hostname or "", parts.port
    except ValueError:
        return f"{url} is no address."
    if parts.scheme not in ("http", "https") or parts.username is not None:
        return f"{url} is no http address without a name in it."
    if host not in _HERE and host not in hosts:
        return f"{host or url} is not this computer: start the studio with --webhook-host {host or 'NAME'}."
    return ""


async def tell_ended(studio: Studio, name: str = "", task: Task | None = None) -> None:
    """Tell how a batch ended, once its task has; without a name all that a studio that was killed did not tell."""
    if task is not None:
        await task.wait()
    for wait in _AGAIN:
        await asyncio.sleep(wait)
        try:
            untold = await studio.answer("what is to be told", Call("batch_desk.list_untold", (name,)))
            for news in untold:
                why = check_address(news["url"], studio.hosts) or await asyncio.to_thread(_post, news)
                noted = Call("batch_desk.note_told", (news["batch"], news["id"], why))
                await studio.answer("what was told", noted)
        except HTTPException:  # it was deleted, or much else is to be done
            continue
        if not untold:
            return


def _post(news: dict[str, str]) -> str:
    """Send news; why it was not heard, "" where it was."""
    stamp = str(int(time.time()))
    signature = hmac.new(news["secret"].encode(), f"{stamp}.{news['text']}".encode(), "sha256").hexdigest()
    headers = {"Content-Type": "application/json", "Handout-Id": news["id"]}
    headers["Handout-Signature"] = f"t={stamp},v1={signature}"
    asked = urllib.request.Request(news["url"], news["text"].encode(), headers)
    try:
        with _OPENER.open(asked, timeout=_PATIENCE):
            return ""
    except (OSError, ValueError, BrokenAnswer) as error:
        return f"{news['url']} did not hear it: {error}."
