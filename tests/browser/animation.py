"""Makes one moving picture of the frames of animation.mjs: python3 animation.py FRAMES FILE.webp (needs Pillow)."""

import sys
from pathlib import Path

from PIL import Image

# Ten seconds, which begin and end with a moment of rest.
FRAME_MS, REST_MS = 90, 600
BYTES_MAX = 1_500_000
# Of the page's own pixels, which are enough for a README's column.
WIDTH = 800

frames = []
for file in sorted(Path(sys.argv[1]).glob("*.png")):
    with Image.open(file) as picture:
        size = (WIDTH, round(picture.height * WIDTH / picture.width))
        frames.append(picture.convert("RGB").resize(size, Image.Resampling.LANCZOS))
durations = [REST_MS] + [FRAME_MS] * (len(frames) - 2) + [REST_MS]
options = {"quality": 75, "method": 6, "minimize_size": True} if sys.argv[2].endswith(".webp") else {"optimize": True}
frames[0].save(sys.argv[2], save_all=True, append_images=frames[1:], duration=durations, loop=0, **options)
size = Path(sys.argv[2]).stat().st_size
print(f"{sys.argv[2]}: {len(frames)} frames, {sum(durations) / 1000:.1f} s, {size:,} bytes")
sys.exit(size > BYTES_MAX)
