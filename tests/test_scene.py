"""Plans of scenes: what is left out, and that the promise holds."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj
from fiberjax.along import Along
from fiberjax.counting import cost, operations
from fiberjax.expenses import baseline
from fiberjax.farfield import evaluate_model
from fiberjax.planned import ByLobe, Tabled
from fiberjax.planning import plan
from fiberjax.scene import Plan, Scene

sys.path.insert(0, str(Path(__file__).parents[1] / "figures"))
cases = import_module("shared.scene_cases")
untyped: Any = Scene
HAIR = {"eta": 1.55, "beta_m": 0.3, "beta_n": 0.3}
COUNT = 1 << 12
FAST = ("black hair", "R only")


def of(*names):
    """Scenes as parameters; one process plans a scene for all asked of its plan."""
    slow = {
        name: [pytest.mark.slow, pytest.mark.xdist_group(name)]
        for name in names
        if name not in FAST
    }
    return [pytest.param(name, marks=slow.get(name, ())) for name in names]


NAMES = of(*cases.SCENES)
BY_TABLES = [name for name in cases.SCENES if name not in ("smooth", "reference")]
LEFT_OUT = {"black hair": {"rest"}, "R only": {"TT", "TRT", "rest"}}
ABSENT = {"clear fiber": {"absorption"}, "no tilt": {"tilt"}}
_PLANS: dict[str, Plan] = {}


def planned(name):
    """The plan of a scene, made once."""
    if name not in _PLANS:
        _PLANS[name] = plan(cases.SCENES[name])
    return _PLANS[name]


def by_lobe(model) -> ByLobe:
    assert isinstance(model.rule, ByLobe)
    return model.rule


def counted(f, scene, count=1 << 14):
    """Operations of one value, in one color: those of the fiber alone vanish."""
    fiber, angles = cases.inside(scene, count, 0)
    if fiber.sigma_a is not None:
        fiber = replace(fiber, sigma_a=fiber.sigma_a[0])
    return operations(partial(f, fiber), *angles, per=count)


def at_the_ends(scene, count, seed):
    """A fiber at a corner of the scene, and angles of which half are at an end."""
    rng = np.random.default_rng(seed)

    def end(name, like):
        low, high = np.asarray(scene.ends(name), like.dtype)
        return jnp.where(jnp.asarray(rng.random(like.shape) < 0.5), low, high)

    fiber, angles = cases.inside(scene, count, seed)
    names = "eta", "beta_m", "beta_n", "alpha", "sigma_a"
    given = {name: x for name in names if (x := getattr(fiber, name)) is not None}
    fiber = replace(fiber, **{name: end(name, x) for name, x in given.items()})
    stay = [jnp.asarray(rng.random(count) < 0.5) for _ in angles]
    ends = map(end, ("theta_i", "theta_o", "phi"), angles)
    return fiber, [jnp.where(*each) for each in zip(stay, angles, ends, strict=True)]


@pytest.mark.parametrize("name", NAMES)
def test_a_plan_keeps_its_promise(name):
    """Values, albedo, density and samples of fibers that no plan has seen."""
    found = planned(name)
    scene = found.scene
    assert found.bound <= scene.tolerance
    assert found.albedo_bound <= scene.tolerance
    assert found.pdf_bound <= scene.tolerance
    fiber, angles = cases.inside(scene, 256, 0)
    for seed, drawn in product(range(1, 7), (at_the_ends, cases.inside)):
        fiber, angles = drawn(scene, 256, seed)
        scene.check(fiber, theta_i=angles[0], theta_o=angles[1], phi=angles[2])
        assert cases.achieved(found.evaluate, scene, fiber, angles) <= scene.tolerance
    wide = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), fiber)
    theta_i = jnp.asarray(angles[0][:16], jnp.float64)
    wide_enough = scene.low("beta_n") >= 0.05
    rule: Any = {"rule": fj.GaussGamma(160)} if wide_enough else {}
    incidence: Any = {"incidence": scene.incidence}
    albedo = fj.albedo(wide, theta_i, rule=fj.GaussGamma(160), **incidence)
    near = found.albedo(fiber, angles[0][:16]).astype(albedo.dtype)
    off = jnp.abs(near / albedo - 1)
    assert float(off.max()) <= scene.tolerance
    kept = {"lobes": found.model.lobes, "rest": found.model.rest}
    kept |= {"detector": scene.detector, "incidence": scene.incidence}
    u = np.random.default_rng(0).uniform(size=(64, 5)).astype(scene.dtype)
    draw, eps = found.sample(fiber, angles[0][0], u), float(jnp.finfo(scene.dtype).eps)
    assert draw.weight.dtype == jnp.dtype(scene.dtype)
    for a, b in zip(draw, fj.sample(fiber, angles[0][0], u, **kept), strict=True):
        np.testing.assert_allclose(a, b, rtol=100 * eps)
    assert found.evaluate(fiber, *angles).dtype == jnp.dtype(scene.dtype)
    exact = fj.pdf(
        wide, *(jnp.asarray(x[:64], jnp.float64) for x in angles), **kept, **rule
    )
    density = found.pdf(fiber, *(x[:64] for x in angles)).astype(exact.dtype)
    assert float(jnp.abs(density - exact).max()) <= scene.tolerance * float(exact.max())


@pytest.mark.parametrize("name", NAMES)
def test_what_is_left_out_is_not_compiled(name):
    found = planned(name)
    scene = found.scene
    after = counted(found.evaluate, scene)
    model = found.model
    parts = len(model.parts)
    gone = {row.part for row in found.rows if row.decision == "left out"}
    assert gone == LEFT_OUT.get(name, set())
    absent = {row.part for row in found.rows if row.decision == "absent"}
    assert absent == ABSENT.get(name, set())
    # One exponential for each M, one for a tilt's sine and cosine of the whole call.
    rules = {type(rule).__name__ for _, rule in by_lobe(model).rules}
    assert (rules == {"Tabled"}) == (name in BY_TABLES)
    if name in BY_TABLES:
        assert after["exp"] < parts + 1
        assert after["trigonometric"] < 0.1
    if model.along is not None:
        assert after["bessel"] == 0
    # `auto` decides when running: the same with the nodes of the fiber that takes most.
    before = counted(partial(evaluate_model, baseline(scene)), scene)
    assert cost(after) < cost(before) / (3 if name != "reference" else 1)


@pytest.mark.parametrize("name", NAMES)
def test_the_lowered_program(name):
    """Less of every kind is compiled than in the full model, whatever is run of it."""
    found = planned(name)
    fiber, angles = cases.inside(found.scene, COUNT, 2)
    full, text = (
        jax.jit(f).lower(fiber, *angles).as_text()
        for f in (cases.full(found.scene), found.evaluate)
    )

    def each(kinds, text, size=""):
        return len(re.findall(rf"stablehlo.({kinds}) [^\n]*tensor<{size}", text))

    logs = "log|log_plus_one|power"
    exponentials = "exponential|exponential_minus_one"
    trigonometric = "sine|cosine|tan|atan2"
    for kinds in (logs, exponentials, trigonometric, "sqrt|rsqrt"):
        assert each(kinds, text) < each(kinds, full)
    # Those of the fiber alone: the tilt of each lobe.
    parts = len(found.model.parts)
    tilts = 0 if found.scene.alpha is None else 2 * parts
    if name in BY_TABLES:
        # Of all directions at once there is one exponential for each M, and no angle.
        every = f"{COUNT}x"
        assert each(logs, text) == 0
        assert each(trigonometric, text) <= tilts
        assert 1 <= each(exponentials, text, every) <= parts
        assert each(trigonometric, text, every) == 0
        assert each("multiply", text, every) > 100
    elif name == "reference":
        assert each(logs, text) == 0


def test_choices_are_made_by_cost():
    """What is chosen takes fewer operations than the nodes it stands in for."""
    found = planned("black hair")
    tables = by_lobe(found.model)
    assert any(isinstance(r, Tabled) for _, r in tables.rules)
    rules = tuple(
        (p, r.otherwise if isinstance(r, Tabled) else r) for p, r in tables.rules
    )
    nodes = replace(found.model, rule=replace(tables, rules=rules))
    by_nodes = cost(counted(partial(evaluate_model, nodes), found.scene))
    assert cost(counted(found.evaluate, found.scene)) < by_nodes / 2


def test_absorption_and_tilt_are_not_compiled():
    """By nodes, where the optics are in every term."""

    def few(**effects):
        model = planned("black hair").model
        rules = tuple(
            (p, r.otherwise if isinstance(r, Tabled) else r)
            for p, r in by_lobe(model).rules
        )
        given = Scene(**HAIR, **effects, tolerance=1e-3)
        found = replace(
            planned("black hair"),
            scene=given,
            model=replace(model, rule=replace(by_lobe(model), rules=rules), along=None),
        )
        return counted(found.evaluate, given)

    whole, clear, straight = (
        few(alpha=-0.03, sigma_a=1.0),
        few(alpha=-0.03),
        few(sigma_a=1.0),
    )
    assert clear["flop"] < whole["flop"] - 100
    assert clear["root"] < whole["root"]
    assert straight["trigonometric"] <= whole["trigonometric"]
    assert straight["flop"] < whole["flop"]


def slopes(f, fiber, angles):
    """Derivatives of a mean square in the fiber's numbers and in angles."""

    def total(fiber, *angles):
        return (f(fiber, *angles) ** 2).mean()

    return jax.tree.leaves(
        jax.grad(total, (0, *range(1, 1 + len(angles))))(fiber, *angles)
    )


@pytest.mark.parametrize("name", of("black hair", "smooth", "game"))
def test_derivatives_are_those_of_the_full_model(name):
    found = planned(name)
    scene = found.scene
    fiber, angles = cases.inside(scene, COUNT // 2, 3)
    ends = scene.low("beta_n") / 1.01, scene.high("beta_n") * 1.01
    rule = fj.GaussGamma(96) if ends[0] >= 0.05 else fj.auto(1e-12, *ends)
    full = partial(fj.evaluate, rule=rule)
    kept = {"lobes": found.model.lobes, "rest": found.model.rest}
    exact, near = (slopes(f, fiber, angles) for f in (full, found.evaluate))
    if name == "black hair":
        for f, g in (
            (partial(fj.albedo, rule=rule), found.albedo),
            (partial(fj.pdf, rule=rule, **kept), found.pdf),
        ):
            some = [x[:64] for x in angles[: 1 if g == found.albedo else 3]]
            exact += slopes(f, fiber, some)
            near += slopes(g, fiber, some)
    mean = float((found.evaluate(fiber, *angles) ** 2).mean())
    # A closed form does not know the width of its detector, and little depends on it.
    unknown = (fiber.beta_n, fiber.widths_n) if name == "smooth" else ()
    # Derivatives of albedo and pdf, if any, come behind.
    leaves = [*jax.tree.leaves(fiber), *angles] + [None] * len(exact)
    for x, a, b in zip(leaves[: len(exact)], exact, near, strict=True):
        assert b.dtype == jnp.dtype(scene.dtype)
        scale = float(jnp.abs(a).max())
        if any(x is y for y in unknown):
            scale = mean / float(jnp.max(x))
        np.testing.assert_allclose(b, a, rtol=0, atol=10 * scene.tolerance * scale)


def test_few_directions_take_nodes():
    """A value by itself and a value among many differ by less than the bounds."""
    found = planned("black hair")
    fiber, angles = cases.inside(found.scene, COUNT, 1)
    many = found.evaluate(fiber, *angles)
    one = jnp.stack([found.evaluate(fiber, *(x[k] for x in angles)) for k in range(4)])
    peak = float(many.max())
    assert float(jnp.abs(many[:4] - one).max()) < 2 * found.scene.tolerance * peak
    grid = found.evaluate(
        fiber, angles[0][:8, None, None], angles[1][:8, None], angles[2][:64]
    )
    assert grid.shape == (8, 8, 64, 3)
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), fiber)
    twice = jax.vmap(lambda f: found.evaluate(f, *angles))(batch)
    np.testing.assert_allclose(twice[1], many, rtol=1e-12, atol=1e-14 * peak)


@pytest.mark.slow
def test_one_direction_up_to_a_pole():
    """At one phi few nodes may be right by chance, and their table is not."""
    given = {"theta_i": (1.4, np.pi / 2), "theta_o": -1.2, "phi": 0.3}
    scene = replace(cases.SCENES["one theta_i"], **given)
    found = plan(scene)
    assert {type(rule) for _, rule in by_lobe(found.model).rules} == {Tabled}
    for seed in range(1, 7):
        fiber, angles = at_the_ends(scene, 1024, seed)
        assert cases.achieved(found.evaluate, scene, fiber, angles) < 1e-4


@pytest.mark.slow
def test_a_scene_unlike_the_others():
    """All that has another choice has it, from a refractive index of 1 on."""
    scene = Scene(
        eta=(1.0, 1.7),
        beta_m=(0.03, 0.8),
        beta_n=(0.01, 0.9),
        alpha=(-0.2, 0.3),
        sigma_a=(0, 20),
        widths_m=(1.0, 0.7, 1.6),
        widths_n=(1.0, 0.9, 1.3),
        tilts=(2.0, -1.0, -4.0, 0.5),
        detector="logistic",
        incidence="theta_i",
        strategy="lobe_first",
        tolerance=1e-3,
    )
    found = plan(scene)
    assert "auto(" in str(found)
    for seed, drawn in product((1, 2), (at_the_ends, cases.inside)):
        fiber, angles = drawn(scene, 256, seed)
        assert cases.achieved(found.evaluate, scene, fiber, angles) < 1e-3


def test_a_plan_in_blocks_and_baked():
    """What takes a function takes that of a plan."""
    found = planned("R only")
    fiber, angles = cases.inside(found.scene, COUNT, 5)
    whole = found.evaluate(fiber, *angles)
    many = fj.in_blocks(found.evaluate, block=COUNT // 4)(fiber, *angles)
    np.testing.assert_allclose(many, whole, rtol=1e-12, atol=1e-14 * float(whole.max()))
    one = partial(found.evaluate, fiber, 0.6)
    ranges = {"theta_o": (-1.5, 1.5), "phi": (0.0, np.pi)}
    baked = fj.tabulate(one, ranges, tolerance=5e-3, entries=1 << 16)
    at = {"theta_o": jnp.clip(angles[1], -1.5, 1.5), "phi": jnp.abs(angles[2]) % np.pi}
    error = baked(**at) - one(**at)
    assert float(jnp.abs(error / baked.scale).max()) < 5e-3


def test_the_table_of_a_plan(tmp_path):
    found = planned("R only")
    text = str(found)
    rows = found.report()
    assert [row["part"] for row in rows[:4]] == ["R", "TT", "TRT", "rest"]
    assert {row["decision"] for row in rows[1:4]} == {"left out"}
    for row in rows:
        assert row["part"] in text
        assert row["decision"] in text
    assert found.bound == pytest.approx(sum(row["bound"] for row in rows))
    assert all(row["after"] < row["before"] for row in rows[:4])
    path = tmp_path / "plan.json"
    found.save(path)
    again = Plan.load(path)
    assert again == found
    assert hash(again) == hash(found)
    first = path.read_bytes()

    def no_json(text):
        raise AssertionError(f"{text} is no JSON")

    json.loads(first, parse_constant=no_json)
    again.save(path)
    assert path.read_bytes() == first
    broken = json.loads(first)
    del broken["rule"]
    for text in (json.dumps(broken), json.dumps({**broken, "rule": "x"}), "[]", "{"):
        path.write_text(text)
        with pytest.raises(ValueError, match="must be the file of a plan"):
            Plan.load(path)
    path.write_text(json.dumps({**json.loads(first), "format": 0}))
    with pytest.raises(ValueError, match="has format 0, must have 1"):
        Plan.load(path)


def test_the_scene_of_some_fibers():
    fibers = jax.vmap(lambda b: fj.Fiber(beta_m=b, beta_n=b, alpha=None))(
        jnp.asarray([0.2, 0.4])
    )
    found = Scene.of(fibers, tolerance=1e-3)
    assert found.beta_n == (0.2, 0.4)
    assert found.eta == (1.55, 1.55)
    assert found.alpha is None
    assert found.sigma_a == (0.5447, 1.781)
    found.check(fibers)
    with pytest.raises(ValueError, match=r"beta_m = 0.7: must lie in \[0.2, 0.4\]"):
        found.check(replace(fibers, beta_m=jnp.asarray([0.3, 0.7])))
    wide = jnp.asarray([[1.0, 0.5, 2.0], [1.0, 1.0, 1.0]])
    with pytest.raises(ValueError, match="widths_m differs among the fibers"):
        Scene.of(replace(fibers, widths_m=wide), tolerance=1e-3)
    with pytest.raises(ValueError, match=r"eta = 1.5: is that of the fibers"):
        Scene.of(fibers, eta=1.5, tolerance=1e-3)
    none = jax.tree.map(lambda x: x[:0], fibers)
    with pytest.raises(ValueError, match=r"eta of the fibers has shape \(0,\)"):
        Scene.of(none, tolerance=1e-3)


def test_a_check_allows_the_rounding_of_float32_alone():
    wide = Scene(
        eta=1.55, beta_m=0.3, beta_n=(1e-6, 1), sigma_a=(0, 1e4), tolerance=0.1
    )
    inside = fj.Fiber(1.55, 0.3, np.float32(1e-6), None, np.float32(1e4))
    wide.check(inside)
    with pytest.raises(ValueError, match=r"beta_n = 1e-09: must lie in \[1e-06, 1\]"):
        wide.check(replace(inside, beta_n=1e-9))
    with pytest.raises(ValueError, match=r"sigma_a = -0.005: must lie in \[0, 10000\]"):
        wide.check(replace(inside, sigma_a=-5e-3))


BAD = {
    "inverted": (
        {"beta_n": (0.4, 0.2)},
        r"beta_n = \(0.4, 0.2\): must be \(low, high\)",
    ),
    "empty": ({"beta_n": ()}, r"beta_n = \(\): must be a number or \(low, high\)"),
    "three": ({"eta": (1, 2, 3)}, r"eta = \(1, 2, 3\): must be a number"),
    "text": ({"eta": "glass"}, "eta = 'glass': must be a number"),
    "below": ({"eta": 0.9}, r"eta = 0.9: must be finite and lie in \[1, inf\]"),
    "no roughness": ({"beta_m": 0.0}, r"beta_m = 0.0: .* \(0, inf\]"),
    "nan": ({"sigma_a": float("nan")}, "sigma_a = nan: must be finite"),
    "infinite": ({"sigma_a": (0, np.inf)}, "must be finite"),
    "theta": ({"theta_i": (-2, 0)}, r"theta_i = \(-2, 0\): must be finite and lie in"),
    "no theta": ({"theta_o": None}, "theta_o = None: must be a number"),
    "tolerance": ({"tolerance": 0.0}, r"tolerance = 0.0: must lie in \(0, 1\)"),
    "no tolerance": ({"tolerance": None}, "tolerance = None: must lie in"),
    "two tolerances": ({"tolerance": (1e-3,)}, r"tolerance = \(0.001,\): must lie in"),
    "dtype": ({"dtype": "float16"}, "dtype = 'float16': must be one of"),
    "unknown dtype": ({"dtype": "foo"}, "dtype = 'foo': must be one of"),
    "no dtype": ({"dtype": None}, "dtype = None: must be one of"),
    "digits": ({"eta": "1.5"}, "eta = '1.5': must be a number"),
    "flag": ({"beta_m": True}, "beta_m = True: must be a number"),
    "no widths": ({"widths_m": None}, "widths_m = None: must be numbers"),
    "text for widths": ({"widths_m": ("a",)}, r"widths_m = \('a',\): must be numbers"),
    "detector": ({"detector": "box"}, "detector = 'box': must be one of"),
    "strategy": ({"strategy": "best"}, "strategy = 'best': must be one of"),
    "widths": ({"widths_m": ()}, r"widths_m = \(\): must be numbers"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_say_what_is_allowed(case):
    given, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        untyped(**{**HAIR, "tolerance": 1e-3, **given})


def test_what_a_plan_refuses():
    found = planned("R only")
    fiber, angles = cases.inside(found.scene, 4, 0)
    with pytest.raises(ValueError, match="the angles are float32: must be float64"):
        found.evaluate(fiber, *(x.astype(jnp.float32) for x in angles))
    with pytest.raises(ValueError, match="sigma_a of the fiber is None"):
        found.evaluate(replace(fiber, sigma_a=None), *angles)
    straight = replace(found, scene=replace(found.scene, alpha=None))
    with pytest.raises(ValueError, match="alpha of the fiber: must be None"):
        straight.evaluate(fiber, *angles)
    with pytest.raises(ValueError, match="gradient = 'none'"):
        found.sample(fiber, 0.1, np.full(5, 0.5), gradient="none")
    with pytest.raises(ValueError, match="clamp = 0"):
        found.sample(fiber, 0.1, np.full(5, 0.5), clamp=0)


def test_a_plan_samples_by_the_strategy_of_its_scene():
    """With the clamp and the gradient that are asked for; the density is its own."""
    found = planned("R only")
    fiber, angles = cases.inside(found.scene, 64, 0)
    u = np.random.default_rng(1).uniform(size=(32, 5))
    how: Any = {"clamp": 0.5, "gradient": "detached"}
    kept: Any = {"lobes": found.model.lobes, "rest": found.model.rest}
    for strategy in ("lobe_first", "lobe_again"):
        other = replace(found, scene=replace(found.scene, strategy=strategy))
        drawn = fj.sample(fiber, 0.3, u, strategy=strategy, **how, **kept)
        for a, b in zip(other.sample(fiber, 0.3, u, **how), drawn, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13)
        density = fj.pdf(
            fiber, *angles, strategy=strategy, rule=fj.GaussGamma(96), **kept
        )
        off = float(jnp.abs(other.pdf(fiber, *angles) - density).max())
        assert off <= found.scene.tolerance * float(density.max())


def test_a_tolerance_that_rounding_hides(tmp_path):
    """The error says what can be reached, and it can, also where float64 is off."""
    scene = replace(cases.SCENES["R only"], dtype="float32", tolerance=1e-9)
    message = r"tolerance = 1e-09: must be >= (\S+) for this scene in float32"
    with pytest.raises(ValueError, match=message) as refused:
        plan(scene)
    reachable = re.search(message, str(refused.value))
    assert reachable
    with pytest.raises(ValueError, match=rf"must be >= {reachable[1]} for"):
        plan(replace(scene, tolerance=0.49 * float(reachable[1])))
    found = plan(replace(scene, tolerance=float(reachable[1])))
    assert found.bound <= float(reachable[1]) < 1e-3
    found.save(tmp_path / "plan.json")
    script = tmp_path / "float32.py"
    script.write_text(
        "import sys, warnings; warnings.simplefilter('error')\n"
        "import fiberjax as fj\n"
        "plan = fj.scene.Plan.load(sys.argv[1])\n"
        "hair = fj.Fiber(1.55, 0.3, 0.3, -0.04, 40.0)\n"
        "print(plan.evaluate(hair, 0.3, -0.2, 1.0))\n"
    )
    run = [sys.executable, script, tmp_path / "plan.json"]
    text = subprocess.run(run, check=True, capture_output=True, text=True).stdout
    exact = fj.evaluate(fj.Fiber(1.55, 0.3, 0.3, -0.04, 40.0), 0.3, -0.2, 1.0)
    assert float(text) == pytest.approx(float(exact), rel=1e-3)


@pytest.mark.parametrize("ends", [(0.0, 5.0), (0.0, 1e8), (20.0, 300.0)])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-10])
def test_the_polynomial_of_I0(ends, tolerance):
    from scipy.special import i0e

    form = Along(ends[0], ends[1], tolerance)
    a = np.concatenate([np.geomspace(ends[0] + 1e-9, ends[1], 4001), [ends[0]]])
    off = np.abs(form.bessel(jnp.asarray(a)) / i0e(a) - 1)
    assert off.max() <= 1.05 * tolerance + 6e-14
    # Where float32 does not hold a, and in it, as `formulas.along` counts its rounding.
    far = Along(0.0, 1e40, tolerance).bessel(jnp.asarray(1e39))
    assert float(far) == pytest.approx(i0e(1e39), rel=1.05 * tolerance + 4e-15)
    single = np.asarray(form.bessel(jnp.asarray(a, jnp.float32)))
    assert single.dtype == np.float32
    if tolerance > 1e-7:
        rounding = 16 * float(np.finfo(np.float32).eps)
        assert np.abs(single / i0e(a) - 1).max() <= 1.05 * tolerance + rounding
    narrow = Along(20.0, 300.0, tolerance)
    assert narrow.terms <= Along(0.0, 1e8, tolerance).terms


def test_counting():
    """Loops as often as they run, nothing that no result needs."""

    def f(x):
        jnp.sin(x)  # needed by nothing
        return jax.lax.fori_loop(0, 5, lambda _, y: jnp.exp(y) + x, x)

    found = operations(f, jnp.ones(8), per=8)
    assert found["exp"] == 5
    assert found["trigonometric"] == 0
    assert operations(jnp.dot, jnp.ones((4, 3)), jnp.ones((3, 2)))["flop"] == 48
