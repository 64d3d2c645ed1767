#!/usr/bin/env bash
# Makes the pictures of the README with the program itself: docs/pictures/make.sh, from the top of the checkout.
set -euo pipefail
here=$(dirname "$0")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for hand in joined quick print; do
  handout write "The hens have taken to sitting in the wheelbarrow as if it belonged to them; yesterday I found two eggs in my left boot. (house-$hand)" \
    --hand "house-$hand" --page 160x40mm --margin 3mm,6mm --seed 5 --pen ballpoint --pages 1 --fit --dpi 170 --quiet -o "$work/$hand.png"
done
handout write --file examples/formulas.txt --hand house-joined --page 110x115mm --margin 5mm --seed 4 --dpi 110 --quiet -o "$work/formulas.png"
for pen in ballpoint fineliner fountain pencil; do
  handout write "written with a $pen" --hand house-quick --page 75x20mm --margin 4mm --pages 1 --fit --seed 3 --pen "$pen" --dpi 300 --quiet -o "$work/pen-$pen.png"
done
for brush in dry-brush marker sumi crayon; do
  handout write "Happy birthday, Zoë" --hand house-print --page 165x34mm --margin 5mm --x-height 7mm --pen-width 1.8mm --seed 1 --pen "$brush" --dpi 130 --quiet -o "$work/brush-$brush.png"
done
handout write "Happy birthday, Zoë" --page 130x24mm --margin 4mm --x-height 4mm --seed 3 --dpi 200 --quiet --pose firm --pen brushpen --pen-width 0.9mm -o "$work/pose-firm.png"
handout write "Happy birthday, Zoë" --page 130x24mm --margin 4mm --x-height 4mm --seed 3 --dpi 200 --quiet --pose light --pen chisel --pen-width 1.1mm -o "$work/pose-light.png"
handout write --file examples/letter.txt --hand house-quick --page A5 --x-height 1.9mm --fit --seed 4 --pen ballpoint --dpi 130 --quiet -o "$here/letter.png"
handout write examples/thank-you.md --seed 4 --dpi 130 --paper plain --quiet -o "$here/thank-you.png"
handout write examples/letter.md --seed 4 --dpi 100 --quiet -o "$work/of-letter.png"
python examples/form.py "$work/form.pdf"
python examples/sheet.py "$work/sheet.jpg"
handout write "Dear Ada, thank you for the quinces. We shall visit you in August and bring the old zither; please expect five of us, and Zoë's dog. The hens have taken to sitting in the wheelbarrow as if it belonged to them: yesterday I found two eggs in my left boot." \
  --paper "$work/sheet.jpg" --page A5 --hand house-quick --seed 4 --dpi 130 --quiet -o "$work/sheet.png"
handout fill "$work/form.pdf" examples/form.csv --rows 2 --seed 3 --dpi 150 --quiet -o "$work/form.png"
handout pen test --device simulated --page A5 --dry-run "$work/test-sheet.png" --quiet
handout write "It writes itself." --hand house-joined --page 90x20mm --margin 3mm,6mm --pages 1 --fit --seed 2 --quiet -o "$here/replay.svg"
handout write "Dear Ada, thank you for the quinces. We shall visit you in August and bring the old zither." \
  --hand house-joined-ballpoint --page 130x30mm --margin 4mm,6mm --pages 1 --fit --seed 4 --dpi 150 --quiet -o "$work/scanned.png"
while IFS='|' read -r hand language text; do
  handout write "$text" --hand "house-$hand" --language "$language" --page 110x55mm --margin 4mm,6mm --pages 1 --fit --seed 6 --dpi 140 --quiet -o "$work/alphabet-$language.png"
done <<'TEXTS'
joined|ru|Дорогая бабушка, яблоки дошли целыми. Ждём тебя в гости: щенок вырос и уже сторожит двор.
quick|uk|Уранці над річкою туман. Їжак з'їв грушу на ґанку й пішов; цього літа поїдемо в гори.
print|el|Αύριο θα πάμε στο νησί με το πρώτο καράβι. Ξέρεις τον δρόμο; Φέρε ψωμί και γλυκά!
joined|sr|Топот и граја: ђаци носе у џеповима љешнике, а бака пече пуњене паприке.
TEXTS
handout print examples/abroad.csv --printer pdf --hand house-print --home-country DE --seed 2 --dpi 70 --quiet --dry-run "$work/alphabet-to.png"
handout print examples/envelope.csv --printer pdf --hand house-quick --rows 2-5 --seed 2 --pen fountain --dpi 100 --quiet --dry-run "$work/envelope.png"
handout write "Ink has" --page 60x22mm --margin 5mm --seed 3 --quiet -o "$work/pen.inkml"
handout strokes fit "$work/pen.inkml" -o "$work/plan.json" --report "$here/fit.svg"
handout study make --hand house-joined-ballpoint --people 2 --seed 1 --quiet -o "$work/study"  # proof.png: a screenshot
mkdir -p "$work/studio"
STUDIO_PICTURES="$work/studio" python -m pytest -q -m slow tests/web/test_studio_looks.py tests/web/test_studio_calibration.py -k "desk or chart"
python examples/styles.py "$work/styles.png"
python examples/tags.py "$work/tags.png"
export XDG_DATA_HOME="$work/data" XDG_STATE_HOME="$work/state"
for paper in white cream; do
  handout calibrate wizard --printer sim --paper "$paper" --quiet
  for calibration in none "simulated/$paper"; do
    handout print examples/envelope.csv --printer sim --hand house-quick --rows 2 --seed 2 --pen fountain --calibration "$calibration" \
      --quiet --dry-run "$work/$paper-${calibration%/*}.pdf"
  done
done
python - "$work" "$here" <<'PY'
import subprocess
import sys
from pathlib import Path
from PIL import Image, ImageOps

work, here = map(Path, sys.argv[1:])

def sheet(pictures, columns, to, colours=64):
    pictures = [ImageOps.expand(Image.open(p).convert("RGB"), 1, (200, 200, 200)) for p in pictures]
    w, h = pictures[0].size
    page = Image.new("RGB", (columns * (w + 8) - 8, -(-len(pictures) // columns) * (h + 8) - 8), "white")
    for i, picture in enumerate(pictures):
        page.paste(picture, ((i % columns) * (w + 8), (i // columns) * (h + 8)))
    page.quantize(colours).save(to, optimize=True)

sheet([work / f"{name}.png" for name in ("joined", "quick", "print")], 1, here / "hands.png")
sheet(sorted(work.glob("formulas-*.png")), 2, here / "formulas.png", 16)
sheet(sorted(work.glob("envelope-*.png")), 2, here / "envelope.png")
sheet(sorted(work.glob("alphabet-??.png")) + sorted(work.glob("alphabet-to-*.png")), 2, here / "alphabets.png", 32)
sheet(sorted(work.glob("of-letter-*.png")), 3, here / "letter-pages.png", 256)
for picture in ("start", "write", "table-letter", "own-ask", "letters", "styles", "style", "calibration", "jobs"):
    Image.open(work / "studio" / f"{picture}-desk-light.png").convert("RGB").quantize(256).save(here / f"studio-{picture}.png", optimize=True)
sheet([here / "thank-you.png"], 1, here / "thank-you.png")
sheet([work / "styles.png"], 1, here / "styles.png", 32)
sheet([work / "tags.png"], 1, here / "tags.png", 32)
def printed_and_scanned(paper):
    """An address on a paper of the simulated printer: as it should look, printed as it is, printed through the table."""
    import numpy as np
    from handout.simulated.print_and_scan import make_loop
    from handout.simulated.flatbed import Flatbed
    from handout.profiles import find

    loop = make_loop(find("sim", "printer"), paper)
    loop.flatbed, loop.dpi = Flatbed(skew=0.0, slack=0.0, rotation=0.0, offset=(0.0, 0.0), shading=0.0), 300
    prints = [loop.scan(work / f"{paper}-{name}.pdf", work / f"{paper}-{name}.tif")[0] for name in ("none", "simulated")]
    bare = np.array(Image.open(prints[0]).convert("RGB"))
    bare[:] = np.median(bare, axis=(0, 1)).astype(np.uint8)
    Image.fromarray(bare).save(work / f"{paper}-bare.png", dpi=(300, 300))
    subprocess.run(["handout", "print", "examples/envelope.csv", "--printer", "sim", "--hand", "house-quick", "--rows", "2", "--seed", "2",
                    "--pen", "fountain", "--dpi", "300", "--paper", work / f"{paper}-bare.png", "--quiet", "--dry-run",
                    work / f"{paper}-wanted.png"], check=True)
    for path, name in ((work / f"{paper}-wanted-002.png", "0"), (prints[0], "1"), (prints[1], "2")):
        w, h = (picture := Image.open(path).convert("RGB")).size
        picture.crop((int(w * 0.515), int(h * 0.463), int(w * 0.70), int(h * 0.555))).save(work / f"calibrated-{name}-{paper}.png")

for paper in ("cream", "white"):
    printed_and_scanned(paper)
sheet([work / f"calibrated-{name}-{paper}.png" for paper in ("white", "cream") for name in "012"], 3, here / "calibrated.png", 256)
tried = Image.open(work / "test-sheet.png").convert("L")
tried.resize((620, round(620 * tried.height / tried.width)), Image.LANCZOS).quantize(16).save(here / "test-sheet.png", optimize=True)
sheet([work / "scanned.png"], 1, here / "scanned.png")
sheet([work / f"pen-{name}.png" for name in ("ballpoint", "fineliner", "fountain", "pencil")], 2, here / "pens.png")
sheet([work / f"brush-{name}.png" for name in ("dry-brush", "marker", "sumi", "crayon")], 1, here / "brushes.png", 96)
sheet([work / f"pose-{name}.png" for name in ("firm", "light")], 1, here / "pose.png", 16)
sides = [Image.open(work / name).convert("RGB") for name in ("sheet.jpg", "sheet.png")]
sides = [side.resize((round(540 * side.width / side.height), 540), Image.LANCZOS) for side in sides]
pair = Image.new("RGB", (sum(side.width for side in sides) + 12, 540), "white")
pair.paste(sides[0], (0, 0))
pair.paste(sides[1], (sides[0].width + 12, 0))
pair.quantize(96).save(here / "sheet.png", optimize=True)
import pypdfium2
sheets = pypdfium2.PdfDocument(work / "study" / "sheets.pdf")
pages = [sheets[number].render(scale=1.2).to_pil().convert("L") for number in (1, 2)]
pair = Image.new("L", (sum(page.width for page in pages), pages[0].height), "white")
pair.paste(pages[0], (0, 0))
pair.paste(pages[1], (pages[0].width, 0))
pair.quantize(16).save(here / "study-sheets.png", optimize=True)
filled = Image.open(work / "form-1.png").convert("RGB").crop((100, 225, 1140, 1070))
filled.resize((760, round(760 * filled.height / filled.width)), Image.LANCZOS).quantize(48).save(here / "form.png", optimize=True)
from benchmarks.study import figure_of_many
(here / "study-figure.svg").write_bytes(figure_of_many())
PY
