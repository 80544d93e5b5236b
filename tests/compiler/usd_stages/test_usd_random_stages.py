"""Random stages show what usd-core places: distance, normal and path along rays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st

from tests.compiler.usd_stages.oracle import pieces
from tests.compiler.usd_stages.random_stages import TIMES, random_stage
from tests.compiler.usd_stages.ray_agreement import agree

MANY = 200
"""Pieces beyond which a stage takes too long to be judged."""


@settings(max_examples=20, phases=(Phase.explicit, Phase.reuse, Phase.generate))
@given(
    seed=st.integers(0, 2**32 - 1),
    time=st.sampled_from(["earliest", -1.0, *TIMES, 2.5]),
    precision=st.sampled_from(["float64", "float32"]),
)
def test_rays_hit_what_usd_core_places(
    tmp_path_factory: pytest.TempPathFactory, seed: int, time: Any, precision: str
) -> None:
    path = tmp_path_factory.mktemp("random") / "stage.usda"
    path.write_text(random_stage(seed))
    shown = pieces(path, None if time == "earliest" else time)
    assume(len(shown) <= MANY)
    agree(path, shown, time=time, precision=precision, count=100, least=0.0)


def test_prototypes_beside_the_native_instance_keep_their_own_paths(tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text("""#usda 1.0
class "_kit" {
    def Xform "spot" {
        def Sphere "ball" {
            color3f[] primvars:displayColor = [(1, 0, 0)]
        }
    }
}
class Xform "_yard" {
    def PointInstancer "many" {
        rel prototypes = [</_kit/spot>]
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (4, 0, 0)]
    }
}
def "here" (instanceable = true
    inherits = </_yard>
) {
}
""")
    shown = pieces(path)
    assert [piece.path for piece in shown] == [f"/_kit/spot/ball@/here/many[{i}]" for i in range(2)]
    agree(path, shown)
