"""The second reader: it reads where it is installed, adds to what is thought of a word, and nothing asks for it."""

import importlib.util

import numpy as np
import pytest

from handout.hand import library
from handout.hand.author_reader import own_words
from handout.pipeline import doctor, rereading
from handout.reading import misreading, pictures, second_reader
from handout.writing.legibility import misread_shares

installed = pytest.mark.skipif(importlib.util.find_spec("rapidocr") is None, reason='the extra "reader" is wanted')


@pytest.fixture
def words():
    hand = library.find("house-print-fountain")
    return [word for word in own_words(hand) if len(word.text) > 2 and word.text.isalpha()][:25]


@pytest.fixture
def without(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    second_reader.load.cache_clear()
    yield
    second_reader.load.cache_clear()


def test_where_it_is_not_installed_one_reads_alone(without, words):
    assert second_reader.load() is None
    shown = [word.picture for word in words]
    assert [len(readings) for readings in rereading.read(shown)] == [1] * len(words)


def test_the_doctor_says_whether_it_is_there(monkeypatch):
    monkeypatch.setattr(doctor, "_requirements", lambda: ['nothing-such>=2; extra == "reader"'])
    (finding,) = doctor.extras()
    assert finding.state == "note" and "second reader" in finding.words and "[reader]" in finding.remedy


def test_an_empty_file_is_no_reader(monkeypatch, tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "PP-OCRv6_rec_small.onnx").write_bytes(b"no network")
    spec = importlib.util.spec_from_loader("rapidocr", None)
    spec.submodule_search_locations = [str(tmp_path)]
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: spec)
    second_reader.load.cache_clear()
    assert second_reader.load() is None
    second_reader.load.cache_clear()


@installed
def test_it_reads_words_and_minds_wrong_letters(words):
    reader = second_reader.load()
    readings, texts = reader.read_all([word.picture for word in words]), [word.text for word in words]
    wrong = [text[:1] + ("k" if text[1] != "k" else "o") + text[2:] for text in texts]
    assert (
        np.mean([reading.verdict(text).reads_as == text for reading, text in zip(readings, texts, strict=True)]) > 0.7
    )
    right, spoilt = (pictures.log_probabilities(readings, some) for some in (texts, wrong))
    assert np.mean(right > spoilt) > 0.9


@installed
def test_what_both_see_counts(words):
    weights = misreading.load(2)
    (first, *_), (text, *_) = rereading.read([word.picture for word in words]), [word.text for word in words]
    seen, before = np.vstack([misreading.shares_seen([one], [text]) for one in first]), np.full(len(text), -3.0)
    usual = weights.misread(before, seen)
    for reader in (0, 1):
        more = seen.copy()
        more[reader] = 0.98
        assert (weights.misread(before, more) > usual).all()


@installed
def test_it_looks_only_where_what_it_sees_may_matter(monkeypatch, words):
    hand, looked = library.find("house-print-fountain"), list[int]()
    read_all = second_reader.SecondReader.read_all
    monkeypatch.setattr(
        second_reader.SecondReader, "read_all", lambda self, shown: looked.append(len(shown)) or read_all(self, shown)
    )
    rng, weights = np.random.default_rng(2), misreading.load(2)
    rereader = rereading.Rereader(hand, hand, 0)
    rereader(rereading.write_words(hand, [word.text for word in words], rng))
    assert looked[0] < len(words) / 2
    readings, texts = rereading.read([word.picture for word in rereader.words]), [word.text for word in rereader.words]
    seen = [misreading.shares_seen(each, texts) for each in zip(*readings, strict=True)]
    of_glyph, of_letter = misread_shares(hand)
    for word, *shares in zip(rereader.words, *seen, strict=True):
        before = weights.before(of_glyph[word.numbers], of_letter[word.numbers])
        full = 1 - np.prod(1 - weights.misread(before, np.array(shares)))
        assert full <= word.wrong + 1e-9
        assert word.wrong < weights.again or word.wrong == pytest.approx(full, abs=1e-6)
