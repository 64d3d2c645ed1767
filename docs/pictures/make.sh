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
for pen in ballpoint fineliner fountain pencil; do
  handout write "written with a $pen" --hand house-quick --page 75x20mm --margin 4mm --pages 1 --fit --seed 3 --pen "$pen" --dpi 300 --quiet -o "$work/pen-$pen.png"
done
handout write --file examples/letter.txt --hand house-quick --page A5 --x-height 1.9mm --fit --seed 4 --pen ballpoint --dpi 130 --quiet -o "$here/letter.png"
handout write "It writes itself." --hand house-joined --page 90x20mm --margin 3mm,6mm --pages 1 --fit --seed 2 --quiet -o "$here/replay.svg"
handout write "Dear Ada, thank you for the quinces. We shall visit you in August and bring the old zither." \
  --hand house-joined-ballpoint --page 130x30mm --margin 4mm,6mm --pages 1 --fit --seed 1 --dpi 150 --quiet -o "$work/scanned.png"
handout print examples/envelope.csv --printer pdf --hand house-quick --rows 2-5 --seed 2 --pen fountain --dpi 100 --quiet --dry-run "$work/envelope.png"
python - "$work" "$here" <<'PY'
import sys
from pathlib import Path
from PIL import Image, ImageOps

work, here = map(Path, sys.argv[1:])

def sheet(pictures, columns, to):
    pictures = [ImageOps.expand(Image.open(p).convert("RGB"), 1, (200, 200, 200)) for p in pictures]
    w, h = pictures[0].size
    page = Image.new("RGB", (columns * (w + 8) - 8, -(-len(pictures) // columns) * (h + 8) - 8), "white")
    for i, picture in enumerate(pictures):
        page.paste(picture, ((i % columns) * (w + 8), (i // columns) * (h + 8)))
    page.quantize(64).save(to, optimize=True)

sheet([work / f"{name}.png" for name in ("joined", "quick", "print")], 1, here / "hands.png")
sheet(sorted(work.glob("envelope-*.png")), 2, here / "envelope.png")
sheet([work / "scanned.png"], 1, here / "scanned.png")
sheet([work / f"pen-{name}.png" for name in ("ballpoint", "fineliner", "fountain", "pencil")], 2, here / "pens.png")
PY
