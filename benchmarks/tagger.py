"""Gestures and keystroke-level minutes from a page with 5 % wrong tags to 99 % of letters and 98 % of order right.

Pages of the simulated author, `easy` in a hand that hardly joins, `hard` in a joined one with forms of another, two
texts of each, read as users' pages are.  Where fewer than 5 % of the letters are wrong then, others lose half or most
of their ink to the letter beside them, or half to nobody, or exchange all of it with that letter.  A person is
simulated who knows the truth and asks the studio's server for what its page asks for: he goes through the letters in
the order in which the page offers them, outlines the wrong ones by the hulls of their true ink, goes on by eye where
the page doubts nothing any more, waits while the page learns after the third, as it does by itself, and at the end,
then looks at the replay of each word with a letter whose strokes are wrong, those first whose name is wrong oftenest,
and reverses a stroke by a click, or writes it earlier by a key, where that mends it, or else redraws the letter.  A
letter is right as in `benchmarks.corrections`; its order is right where all of its strokes are found in order and
direction, as `benchmarks.followed` judges, as far as they lie in ink that it has.

Letters that were spoilt had been read rightly, so that learning after three corrections finds most of them again (on
two easy pages 6 of 7 and 7 of 7); where the reading itself was wrong it does not (on a hard one 0 of 9, none broken).

A gesture is whatever changes something: an outline, a click that reverses, a stroke that is redrawn.  Times of
operators, s: Card, Moran and Newell, "The keystroke-level model for user performance time with interactive systems",
Communications of the ACM 23 (1980), 396–410: a key .28 (40 words a minute), pointing 1.1, a hand from keys to mouse or
back .4, making up one's mind 1.35, drawing .9 for each straight piece and .16 a cm.  A letter that is looked at and
left costs a decision and a key; one that is found by eye a decision and pointing.  The other way is the same
corrections in a JSON file: for each corner of an outline a place is read off a picture (pointing, a decision) and
typed, for each redrawn stroke eight places.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.corrections import given, hands, right
from benchmarks.followed import tally
from benchmarks.studio import Server
from handout.hand import file
from handout.hand.drawn import Hand
from handout.hand.library import load
from handout.hand.scanned import ScannedHand
from handout.inking.pen import usual
from handout.page_sizes import page
from handout.tagging.page_tagging import hand_of_pages, tag_page
from handout.values import Array, Indices
from handout.writing.layout import Layout
from handout_lab.author import ground_truth_score, page_score
from handout_lab.author.simulate import Desk, simulate
from handout_lab.author.truth import Simulated

TEXT = (
    "Dear Max, the parcel came on Tuesday, quite dry in spite of the rain. Both jars were whole! We have put six of "
    "them by for winter and given the rest to Vera and her boys. Your father fixed the gate again; it had just begun "
    "to hang."
)
OTHER = (
    "My dear Quentin, you ask whether we shall come by train or drive. By train, I think: the road over the hill is so "
    "bad just now that even Zoe's van got stuck. Expect us on Friday about six, with two cakes, a puzzle and far too "
    "much luggage."
)
_PAGES = (("easy", TEXT, 7), ("easy", OTHER, 11), ("hard", TEXT, 7), ("hard", OTHER, 11))  # with seeds
WRONG, LETTERS, ORDER = 0.05, 0.99, 0.98
LEARN_FIRST, WAIT = 3, 23.0  # corrections after which the page learns by itself, and s of the pause and of learning
KEY, POINT, HOME, DECIDE, PIECE, CM = 0.28, 1.1, 0.4, 1.35, 0.9, 0.16  # s: see above
LOOP, LOOP_CM = 8, 12.0  # straight pieces of an outline, and its length on a screen
STROKE, STROKE_CM = 4, 6.0  # of a stroke that is redrawn
_VARIATION = {"easy": 1.0, "hard": 2.2}
_MOST = 150  # gestures, after which it is given up
_WIDER = 1.5  # pixels: how far outside its line an outline runs


@dataclass
class Person:
    """What somebody did, and what it would take."""

    gestures: int = 0
    seconds: float = 0.0
    typed: float = 0.0
    waited: list[float] = field(default_factory=list)

    def does(self, *operators: float, gesture: bool = True) -> None:
        """Some operators of the model, s, which change something or not."""
        self.gestures += gesture
        self.seconds += sum(operators)

    def types(self, correction: dict[str, Any], places: int) -> None:
        """The same correction in a JSON file."""
        text = json.dumps({"page": 0, **correction}) + ",\n"
        self.typed += DECIDE + len(text) * KEY + places * (DECIDE + POINT + 2 * HOME)


def written(name: str, words: str, seed: int) -> tuple[ScannedHand, Indices, Simulated]:
    """A page of the simulated author as it is read, the true letter of each vertex, and the truth."""
    hand: Hand = load("house-print") if name == "easy" else hands()["mixed"]
    layout = Layout(page("A5"), x_height=2.2, fit=True, jitter=_VARIATION[name])
    simulated = simulate(words, hand, Desk(usual("ballpoint"), layout=layout), rng=np.random.default_rng(seed))
    text = page_score.transcript(simulated)
    made = tag_page(page_score.read(simulated), text, rng=np.random.default_rng(1))
    ats = [i for i, unit in enumerate(text) if not unit.isspace()]
    number = dict(zip((letter.at for letter in simulated.truth.letters), ats, strict=True))
    owners = ground_truth_score.owners(simulated.truth, made.page.graph.uv)
    return hand_of_pages("page", [made]), np.array([number.get(at, -1) for at in owners.tolist()]), simulated


def spoilt(hand: ScannedHand, truth: Indices, rng: np.random.Generator) -> ScannedHand:
    """The hand with so many wrong letters that there are 5 %."""
    every, glyphs = len(set(truth.tolist()) - {-1}), list(hand.glyphs)
    for number in rng.permutation(len(glyphs)).tolist():
        now = replace(hand, glyphs=tuple(glyphs))
        if every - len(right(now, truth)) >= WRONG * every:
            break
        glyph = glyphs[number]
        if glyph.after < 0 or glyph.letter in ".,;:!?i'":
            continue
        other = glyphs[glyph.after]
        x, kind = hand.pages[0].graph.uv[glyph.vertices, 0], rng.choice(["half", "most", "nobody", "exchanged"])
        if kind == "exchanged":
            kept, taken = other.vertices, glyph.vertices
        else:
            kept = glyph.vertices[x <= np.quantile(x, 0.15 if kind == "most" else 0.5)]
            given_ = np.setdiff1d(glyph.vertices, kept)
            taken = other.vertices if kind == "nobody" else np.union1d(other.vertices, given_)
        glyphs[number] = replace(glyph, vertices=kept, ligatures=())
        glyphs[glyph.after] = replace(other, vertices=taken, ligatures=())
    return replace(hand, glyphs=tuple(glyphs))


class Session:
    """One page at the studio's server, and the person who corrects it."""

    def __init__(self, server: Server, path: Path, truth: Indices, simulated: Simulated) -> None:
        self._server, self._path, self._truth, self._simulated = server, path, truth, simulated
        self._url, self._uv = f"/api/hands/{path.stem}", file.load(path).pages[0].graph.uv
        self.person = Person()
        self._facts = self._asked("letters")
        self._letters = {one["id"]: one for one in self._asked("letters/0")["letters"]}
        self._text = file.load(path).pages[0].transcript
        self._every = set(truth.tolist()) - {-1}
        self._given = truth
        self.wrong_now: set[int] = set()
        self.left = 0

    def _asked(self, path: str, body: dict[str, Any] | None = None) -> Any:
        return json.loads(self._server.ask(f"{self._url}/{path}", body))

    def _change(self, path: str, **body: Any) -> None:
        begin = time.perf_counter()
        facts = self._asked(path, {"revision": self._facts["revision"], **body})
        self.person.waited.append(time.perf_counter() - begin)
        self._take(facts)

    def _take(self, facts: Any) -> None:
        self._facts = facts
        if told := facts["told"].get("0"):
            known = self._letters | {one["id"]: one for one in told["letters"]}
            self._letters = {one: known[one] for one in told["order"]}

    def now(self) -> ScannedHand:
        """The hand as it is; asking for its file has the server write it."""
        self._server.ask(f"{self._url}/file")
        return file.load(self._path)

    def wrong(self) -> set[int]:
        """The letters that are wrong."""
        return self._every - right(self.now(), self._truth)

    def letters(self) -> None:
        """Correct letters in the order in which the page offers them, then by eye, until enough are right."""
        seen: set[int] = set()
        most, wrong, learned = (1 - LETTERS) * len(self._every), self.wrong(), False
        while len(wrong) > most and self.person.gestures < _MOST:
            if self.person.gestures == LEARN_FIRST and not learned:
                self.person.does(WAIT, gesture=False)
                self.learn()
                wrong, learned = self.wrong(), True
                continue
            doubts = [one for one in self._letters.values() if one["gain"] > 0 and one["id"] not in seen]
            if doubts:
                at = max(doubts, key=lambda one: float(one["gain"]))["id"]
                self.person.does(DECIDE, KEY, gesture=False)
            else:
                left = wrong - seen
                if not left:
                    break
                at = min(left)
                self.person.does(DECIDE, HOME, POINT, KEY, gesture=False)
            seen.add(at)
            if at in wrong and self._outlined(at):
                wrong = self.wrong()

    def _outlined(self, at: int) -> bool:
        import cv2

        places = self._uv[self._truth == at]
        around = np.concatenate([places + np.array(step) * _WIDER for step in ((1, 1), (1, -1), (-1, 1), (-1, -1))])
        hull = cv2.convexHull(around.astype(np.float32))[:, 0].round(1).tolist()
        one = {"do": "outline", "within": hull, "text": self._text[at]}
        self.person.does(2 * KEY, HOME, POINT, LOOP * PIECE + CM * LOOP_CM, HOME)
        self.person.types({**one, "within": hull[:: max(1, len(hull) // LOOP)]}, min(len(hull), LOOP))
        try:
            self._change("corrections", corrections=[{"page": 0, **one}])
        except OSError:
            return False
        return True

    def learn(self) -> None:
        """Let the page learn, as it does by itself after some corrections."""
        task = self._asked("learning", {"revision": self._facts["revision"]})
        self._take(task["facts"])

    def order(self) -> tuple[int, int]:
        """How many letters have wrong strokes, of those that are right; they are corrected until enough are right."""
        wrong, judged = self._misordered()
        first, most, tried = len(wrong), (1 - ORDER) * judged, set[int]()
        while len(wrong) > most and self.person.gestures < _MOST and set(wrong) - tried:
            left, names = len(wrong), [self._text[at] for at in wrong]
            # what is wrong oftenest comes first: one answer may mend all of a name
            for at in sorted(
                (at for at in wrong if at not in tried), key=lambda at: (-names.count(self._text[at]), at)
            ):
                # others of its name may have set it right since
                if left > most and self.person.gestures < _MOST:
                    left -= not self._reordered(at)
                    tried.add(at)
            wrong, judged = self._misordered()
        self.left = len(wrong)
        return first, judged

    def _strokes(self) -> list[tuple[int, Array]]:
        found: list[tuple[int, Array]] = []
        done: set[int] = set()
        for one in self._letters.values():
            if one["id"] in done or not one["letter"]:
                continue
            x, y = (round(at) for at in one["spot"])
            strokes = self._asked(f"strokes/0/{max(x, 0)}/{max(y, 0)}")["strokes"]
            found += [(each["id"], np.array(each["xy"])) for each in strokes if each["id"] not in done]
            done |= {each["id"] for each in strokes} | {one["id"]}
        return found

    def _true(self) -> dict[int, list[Array]]:
        ats = [i for i, unit in enumerate(self._text) if not unit.isspace()]
        number = dict(zip((letter.at for letter in self._simulated.truth.letters), ats, strict=True))
        true: dict[int, list[Array]] = {}
        for path in self._simulated.truth.paths:
            for own in np.split(np.arange(len(path.of)), np.flatnonzero(np.diff(path.of)) + 1):
                bare = own[~path.ligature[own]]
                if len(bare) > 1 and int(path.of[own[0]]) in number:
                    true.setdefault(number[int(path.of[own[0]])], []).append(path.xy[bare])
        return true

    def _judged(self, at: int, strokes: Sequence[Array], true: Sequence[Array]) -> bool:
        # of ink that its neighbour has the letter's strokes tell nothing
        pixel, seen = self._simulated.truth.pixel, self._uv[(self._truth == at) & (self._given == at)]
        mm = [np.vstack([xy, xy + 1e-3]) if len(xy) < 2 else xy for xy in strokes]
        result = tally([xy * pixel for xy in true], [0] * len(true), [xy * pixel for xy in mm], seen * pixel)
        return result.good == result.words

    def _misordered(self) -> tuple[list[int], int]:
        self._given = given(self.now(), len(self._truth))
        true, strokes = self._true(), dict[int, list[Array]]()
        for at, xy in self._strokes():
            strokes.setdefault(at, []).append(xy)
        known = [at for at in true if at in strokes and at not in self.wrong_now]
        return [at for at in known if not self._judged(at, strokes[at], true[at])], len(known)

    def _reordered(self, at: int) -> bool:
        """Put the strokes of a letter right; whether they are still wrong then."""
        one, true = self._letters[at], self._true()[at]
        x, y = (round(place) for place in one["spot"])
        where = f"strokes/0/{max(x, 0)}/{max(y, 0)}"
        own = [np.array(each["xy"]) for each in self._asked(where)["strokes"] if each["id"] == at]
        self.person.does(DECIDE, HOME, POINT, KEY, 2 * KEY, gesture=False)
        if self._judged(at, own, true):
            return False
        turns = [[xy[::-1] if i == k else xy for i, xy in enumerate(own)] for k in range(len(own))]
        turns += [[*own[:k], own[k + 1], own[k], *own[k + 2 :]] for k in range(len(own) - 1)]
        turned = next((each for each in turns if self._judged(at, each, true)), None)
        if turned is not None:
            self.person.does(DECIDE, POINT, KEY)
        else:
            turned = [xy[:: max(1, len(xy) // 60)] for xy in true]
            self.person.does(DECIDE, 2 * KEY, gesture=False)
            for _ in turned:
                self.person.does(POINT, STROKE * PIECE + CM * STROKE_CM)
        ways = [xy.round(1).tolist() for xy in turned]
        short = [way[:: max(1, len(way) // 8)] for way in ways]
        self.person.types({"do": "strokes", "at": one["spot"], "ways": short}, sum(map(len, short)))
        try:
            self._change("corrections", corrections=[{"page": 0, "do": "strokes", "at": one["spot"], "ways": ways}])
        except OSError:  # it has no ink where it should be
            return True
        own = [np.array(each["xy"]) for each in self._asked(where)["strokes"] if each["id"] == at]
        return not self._judged(at, own, true)


def row(name: str, words: str, seed: int, folder: Path) -> None:
    """Print what one page takes."""
    hand, truth, simulated = written(name, words, seed)
    path = folder / f"{name}{seed}.hand"
    file.save(spoilt(hand, truth, np.random.default_rng(seed)), path)
    server = Server(folder, path)
    try:
        session = Session(server, path, truth, simulated)
        every = len(set(truth.tolist()) - {-1})
        begin = len(session.wrong())
        session.letters()
        outlines, session.wrong_now = session.person.gestures, session.wrong()
        session.learn()
        session.wrong_now = session.wrong()
        first, judged = session.order()
        session.wrong_now = session.wrong()
        person = session.person
        print(
            f"{name:<6}{every:>8}{1 - begin / every:>8.3f}{1 - len(session.wrong_now) / every:>8.3f}{outlines:>9}"
            f"{1 - first / judged:>9.3f}{1 - session.left / judged:>8.3f}{person.gestures - outlines:>9}"
            f"{person.seconds / 60:>9.1f}{person.typed / 60:>9.1f}{person.seconds / person.typed:>8.2f}"
            f"{1000 * statistics.median(person.waited):>9.0f}",
            flush=True,
        )
    finally:
        server.close()


def main() -> None:
    """Print the table."""
    print(
        f"{'':<6}{'letters':>8}{'right':>8}{'then':>8}{'gestures':>9}{'in order':>9}{'then':>8}{'gestures':>9}"
        f"{'minutes':>9}{'by JSON':>9}{'share':>8}{'ms each':>9}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for name, words, seed in _PAGES:
            row(name, words, seed, Path(folder))


if __name__ == "__main__":
    main()
