"""Elementary maps and chains against mpmath at 80 digits."""

from __future__ import annotations

from collections.abc import Iterator

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiler.affine import Affine, Placement
from compiler.transforms import compose, compose_many, elementary
from dsl.scene import Step, StepKind

COUNTS = {"translate": 3, "scale": 3, "rotate": 4, "shear": 6, "reflect": 3, "matrix": 12}


@pytest.fixture(autouse=True, scope="module")
def _precision() -> Iterator[None]:
    with mpmath.workdps(80):
        yield


def _matrix(affine: Affine) -> mpmath.matrix:
    """A single affine map, 4x4."""
    result = mpmath.eye(4)
    for i, row in enumerate(affine.rows):
        for j, entry in enumerate(row):
            hi, lo = (float(np.ravel(part)[0]) for part in (entry.hi, entry.lo))
            result[i, j] = mpmath.mpf(hi) + mpmath.mpf(lo)
    return result


def _exact(step: Step) -> mpmath.matrix:
    """The map of a step, from its definition."""
    v = [mpmath.mpf(float(x)) for x in step.values]
    result = mpmath.eye(4)
    match step.kind:
        case StepKind.TRANSLATE:
            for i in range(3):
                result[i, 3] = v[i]
        case StepKind.SCALE:
            for i in range(3):
                result[i, i] = v[i]
        case StepKind.ROTATE:
            length = mpmath.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
            x, y, z = v[0] / length, v[1] / length, v[2] / length
            k = mpmath.matrix([[0, -z, y, 0], [z, 0, -x, 0], [-y, x, 0, 0], [0, 0, 0, 0]])
            angle = v[3] * mpmath.pi / 180
            result += mpmath.sin(angle) * k + (1 - mpmath.cos(angle)) * (k * k)
        case StepKind.ORIENT:
            x, y, z, w = v
            k = mpmath.matrix([[0, -z, y, 0], [z, 0, -x, 0], [-y, x, 0, 0], [0, 0, 0, 0]])
            result += 2 * w * k + 2 * (k * k)
        case StepKind.SHEAR:
            places = ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))
            for place, value in zip(places, v, strict=True):
                result[place] = value
        case StepKind.REFLECT:
            square = sum(x**2 for x in v)
            for i in range(3):
                for j in range(3):
                    result[i, j] -= 2 * v[i] * v[j] / square
        case StepKind.MATRIX:
            for i in range(3):
                for j in range(4):
                    result[i, j] = v[4 * i + j]
        case StepKind.LOOK_AT:
            back = _unit([v[i] - v[3 + i] for i in range(3)])
            right = _unit(_cross(v[6:9], back))
            above = _cross(back, right)
            for i in range(3):
                result[i, 0], result[i, 1], result[i, 2] = right[i], above[i], back[i]
                result[i, 3] = v[i]
    return result**-1 if step.inverse else result


def _cross(a: list[mpmath.mpf], b: list[mpmath.mpf]) -> list[mpmath.mpf]:
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def _unit(v: list[mpmath.mpf]) -> list[mpmath.mpf]:
    length = mpmath.sqrt(sum(x**2 for x in v))
    return [x / length for x in v]


def _norm(matrix: mpmath.matrix) -> mpmath.mpf:
    return mpmath.mnorm(matrix, "f")


def _check(placement: Placement, exact: mpmath.matrix, factors: int = 1) -> None:
    """Both maps are what they should be, up to their condition in double-double."""
    forward, inverse = _matrix(placement.forward), _matrix(placement.inverse)
    condition = _norm(exact) * _norm(exact**-1)
    bound = factors * condition * mpmath.mpf(2) ** -97
    assert _norm(forward - exact) <= bound * _norm(exact)
    assert _norm(inverse - exact**-1) <= bound * _norm(exact**-1)
    assert _norm(forward * inverse - mpmath.eye(4)) <= bound * condition


def _step(kind: str, *values: float, inverse: bool = False) -> Step:
    return Step(StepKind(kind), np.array(values, dtype=np.float64), inverse)


size = st.floats(min_value=0.1, max_value=10) | st.floats(min_value=-10, max_value=-0.1)


@st.composite
def steps(draw: st.DrawFn) -> Step:
    """A step that is not too near to having no inverse."""
    kind = draw(st.sampled_from(StepKind))
    if kind == StepKind.SHEAR:
        places = draw(st.permutations(range(6)))[:2]
        values = [0.0] * 6
        values[places[0]] = draw(size)
        if {places[0], places[1]} not in ({0, 2}, {1, 4}, {3, 5}):
            values[places[1]] = draw(size)
    elif kind == StepKind.MATRIX:
        values = draw(st.lists(st.floats(-0.2, 0.2), min_size=12, max_size=12))
        for i in range(3):
            values[5 * i] += 1.0
    elif kind == StepKind.LOOK_AT:
        eye = draw(st.lists(size, min_size=3, max_size=3))
        values = [*eye, eye[0] + draw(size), eye[1] + 0.1 * draw(size), eye[2], 0.0, 1.0, 0.0]
    elif kind == StepKind.ORIENT:
        angle = draw(st.floats(min_value=-np.pi, max_value=np.pi))
        axis = np.array(draw(st.lists(size, min_size=3, max_size=3)))
        imaginary = np.sin(angle) / np.linalg.norm(axis) * axis
        numbers = np.append(imaginary, np.cos(angle))
        # As halves, floats and doubles hold it: of length 1 but for their rounding.
        values = numbers.astype(draw(st.sampled_from(["f2", "f4", "f8"]))).tolist()
    else:
        values = draw(st.lists(size, min_size=3, max_size=3))
        if kind == StepKind.ROTATE:
            values.append(draw(st.floats(min_value=-1e4, max_value=1e4)))
    return Step(kind, np.array(values), draw(st.booleans()))


@given(steps())
def test_a_step_is_its_definition_and_has_its_inverse(step: Step) -> None:
    _check(compose([step]), _exact(step))


@given(st.lists(steps(), min_size=1, max_size=8))
@settings(max_examples=50)
def test_chains_are_products_first_step_first(chain: list[Step]) -> None:
    exact = mpmath.eye(4)
    for step in chain:
        exact = _exact(step) * exact
    _check(compose(chain), exact, len(chain))


@given(st.lists(st.lists(steps(), min_size=1, max_size=7), min_size=1, max_size=6))
@settings(max_examples=50)
def test_many_chains_at_once_give_the_bits_of_each_alone(chains: list[list[Step]]) -> None:
    many = compose_many(chains)
    for lane, chain in enumerate(chains):
        _assert_same(many.take(slice(lane, lane + 1)), compose(chain))


@given(st.lists(steps(), min_size=1, max_size=6), st.integers(2, 5), st.randoms())
@settings(max_examples=50)
def test_batches_give_the_bits_of_each_lane_alone(
    chain: list[Step], count: int, random: np.random.Generator
) -> None:
    varied = [
        Step(s.kind, np.stack([s.values * (1.0 + lane / 8) for lane in range(count)]), s.inverse)
        if random.random() < 0.5
        else s
        for s in chain
    ]
    batch = compose(varied)
    for lane in range(count):
        alone = [
            s if s.values.ndim == 1 else Step(s.kind, s.values[lane], s.inverse) for s in varied
        ]
        _assert_same(batch.take(slice(lane, lane + 1)), compose(alone))


@given(st.lists(steps(), min_size=1, max_size=6), st.sampled_from(["f2", "f4"]))
@settings(max_examples=50)
def test_floats_give_the_bits_of_the_doubles_that_they_are(chain: list[Step], kind: str) -> None:
    short = [Step(s.kind, np.stack([s.values, -s.values]).astype(kind), s.inverse) for s in chain]
    wide = [Step(s.kind, s.values.astype(np.float64), s.inverse) for s in short]
    for lane in range(2):
        some = slice(lane, lane + 1)
        placed = compose(wide).take(some)
        if (placed.forward.is_within(1e300) & placed.inverse.is_within(1e300)).all():
            _assert_same(compose(short).take(some), placed)


def _assert_same(a: Placement, b: Placement) -> None:
    for x, y in ((a.forward, b.forward), (a.inverse, b.inverse)):
        for row, other in zip(x.rows, y.rows, strict=True):
            for p, q in zip(row, other, strict=True):
                assert np.ravel(p.hi)[0] == np.ravel(q.hi)[0]
                assert np.ravel(p.lo)[0] == np.ravel(q.lo)[0]


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("batched", [False, True])
def test_rotations_about_axes_have_exact_zeros_and_ones(axis: int, batched: bool) -> None:
    values = np.zeros((2, 4) if batched else 4)
    values[..., axis] = 1.0 if axis else 3.0
    values[..., 3] = 17.0
    rows = elementary(StepKind.ROTATE, values).forward.rows
    for i in range(3):
        for j in range(3):
            if i == axis or j == axis:
                assert (rows[i][j].hi == float(i == j)).all()
                assert (rows[i][j].lo == 0.0).all()


def test_a_mirror_is_its_own_inverse_exactly() -> None:
    placement = compose([_step("reflect", 0, 5e-200, 0)])
    assert np.array_equal(_rounded(placement.forward), np.diag([1.0, -1, 1, 1])[:3])
    assert np.array_equal(_rounded(placement.inverse), np.diag([1.0, -1, 1, 1])[:3])


def _rounded(affine: Affine) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    out = np.empty((1, 3, 4))
    affine.round_into(out)
    return np.asarray(out[0])


def test_a_shear_by_a_million_keeps_all_digits() -> None:
    chain = [_step("shear", 1e6, 0, 0, 0, 0, 0), _step("shear", 0, 0, 1e6 / 3, 0, 0, 0)]
    exact = _exact(chain[1]) * _exact(chain[0])
    for affine, wanted in (
        (compose(chain).forward, exact),
        (compose(chain).inverse, exact**-1),
    ):
        entries = [[float(wanted[i, j]) for j in range(4)] for i in range(3)]
        assert np.array_equal(_rounded(affine), np.array(entries))


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1e150, 1e300])
def test_matrices_of_any_size_invert(scale: float) -> None:
    values = [2 * scale, scale, 0, 5, 0, scale, scale / 4, 0, 0, 0, scale, 0]
    with mpmath.workdps(1000):
        _check(compose([_step("matrix", *values)]), _exact(_step("matrix", *values)))


def test_rows_and_columns_of_very_different_size_invert() -> None:
    values = [1e100, 0, 1e-50, 0, 0, 1e-100, 0, 0, 1e50, 0, 1e5, 1]
    step = _step("matrix", *values)
    inverse = _matrix(compose([step]).inverse)
    with mpmath.workdps(1000):
        exact = _exact(step) ** -1
        for i in range(3):
            for j in range(3):
                assert abs(inverse[i, j] - exact[i, j]) <= mpmath.mpf(2) ** -95 * abs(exact[i, j])


def test_translations_that_cancel_leave_the_rest_exactly() -> None:
    far = 1e12 + 0.1
    chain = [
        _step("translate", far, 1, 0),
        _step("rotate", 0, 0, 1, 90),
        _step("translate", 0, -far, 2.0**-40),
    ]
    assert _rounded(compose(chain).forward)[:, 3].tolist() == [-1.0, 0.0, 2.0**-40]


@pytest.mark.parametrize("count", [10_000, 100_000])
def test_long_chains_cost_no_accuracy(count: int) -> None:
    turn = _step("rotate", 0, 1, 0, 0.036)
    placement = compose_many([[turn] * count]).take(slice(0, 1))
    angle = mpmath.mpf(0.036) * count * mpmath.pi / 180
    for affine, sign in ((placement.forward, 1), (placement.inverse, -1)):
        matrix = _matrix(affine)
        assert abs(matrix[0, 0] - mpmath.cos(angle)) < 1e-26
        assert abs(matrix[0, 2] - sign * mpmath.sin(angle)) < 1e-26


def test_a_long_mixed_chain_is_exact_to_its_rounding() -> None:
    random = np.random.default_rng(7)
    chain = []
    for _ in range(1000):
        chain += [
            Step(StepKind.ROTATE, np.append(random.normal(size=3), random.uniform(-180, 180))),
            Step(StepKind.TRANSLATE, random.normal(size=3)),
            Step(StepKind.SCALE, np.full(3, np.exp(random.normal() / 20))),
            Step(StepKind.REFLECT, random.normal(size=3)),
        ]
    exact = mpmath.eye(4)
    for step in chain:
        exact = _exact(step) * exact
    placement = compose_many([chain]).take(slice(0, 1))
    forward, inverse = _matrix(placement.forward), _matrix(placement.inverse)
    assert _norm(forward - exact) < 1e-26 * _norm(exact)
    assert _norm(forward * inverse - mpmath.eye(4)) < 1e-26 * _norm(exact) * _norm(exact**-1)


@pytest.mark.parametrize(
    "step",
    [
        _step("scale", 1, 0, 1),
        _step("shear", 1, 0, 1, 0, 0, 0),
        _step("matrix", 1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0),
        _step("matrix", *[0.1, 0.2, 0.3, 0, 0.2, 0.4, 0.6, 0, 1, 0, 0, 0]),
        _step("reflect", 0, 0, 0),
        _step("rotate", 0, 0, 0, 10),
        _step("orient", 0.5, 0.5, 0, 0),
        _step("look_at", 1, 1, 1, 1, 1, 1, 0, 1, 0),
        _step("look_at", 0, 0, 0, 0, 1, 0, 0, 2, 0),
        _step("translate", np.nan, 0, 0),
        _step("scale", 1e-200, 1, 1, inverse=True),
    ],
)
@pytest.mark.parametrize("batched", [False, True])
def test_what_has_no_inverse_is_not_finite(step: Step, batched: bool) -> None:
    if batched:
        sound = np.zeros_like(step.values) + COUNTS.get(step.kind, 5)
        step = Step(step.kind, np.stack([step.values, sound]), step.inverse)
    other = _step("scale", 1e-200, 1, 1, inverse=True) if step.inverse else _step("scale", 2, 3, 4)
    placement = compose([step, other])
    finite = [_finite(placement.forward), _finite(placement.inverse)]
    assert not all(finite)


def _finite(affine: Affine) -> bool:
    return all(np.isfinite(np.ravel(e.hi)[0]) for row in affine.rows for e in row)
