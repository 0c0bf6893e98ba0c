"""What every public function owes: jit, vmap, derivatives, dtype, errors."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import fiberjax as fj

untyped: Any = fj  # for input that a type checker refuses
FIBER = fj.Fiber(alpha=-0.03, sigma_a=(0.2, 0.6))
RULE = fj.GaussGamma(24)  # where the default rule is not the subject: soon compiled
U5 = (0.31, 0.62, 0.23, 0.84, 0.45)
WI, WO, TANGENT = (0.3, 0.8, -0.2), (-0.5, 0.1, 0.7), (1.0, 0.2, 0.1)

# Each public function of numbers: a callable of float arguments, and where it is tried.
CASES = {
    "reflectance": (fj.reflectance, (0.4, 1.55)),
    "eta_prime": (fj.eta_prime, (0.4, 1.55)),
    "Phi": (lambda h, e: fj.Phi(2, h, e), (0.4, 1.7)),
    "transmittance": (fj.transmittance, (0.4, 0.3, 1.55, 0.7)),
    "A": (lambda F, T: fj.A(2, F, T), (0.1, 0.6)),
    "A_rest": (lambda F, T: fj.A_rest(3, F, T), (0.1, 0.6)),
    "M": (fj.M, (-0.3, 0.2, 0.1)),
    "sample_M": (lambda c, v, u: fj.sample_M(c, v, u), (-0.3, 0.1, (0.4, 0.7))),
    "wrapped_normal": (fj.wrapped_normal, (1.2, 0.6)),
    "trimmed_logistic": (fj.trimmed_logistic, (1.2, 0.4)),
    "N": (
        lambda f, t, e, s, b: fj.N(1, f, t, eta=e, sigma_a=s, beta_n=b),
        (2.5, 0.4, 1.55, (0.2, 0.6), 0.4),
    ),
    "N_smooth": (
        lambda f, t, e, s: fj.N_smooth(2, f, t, eta=e, sigma_a=s),
        (0.1, 0.3, 1.55, (0.2, 0.6)),
    ),
    "roots": (lambda f, t, e: fj.roots(2, f, t, eta=e).h, (0.1, 0.3, 1.55)),
    "caustics": (lambda t, e: fj.caustics(3, t, eta=e)[:2], (0.3, 1.55)),
    "evaluate": (
        lambda *x: fj.evaluate(FIBER, *x, lobes=(0, 2), rule=RULE),
        (0.3, 0.1, 2.0),
    ),
    "lobe": (lambda *x: fj.lobe(FIBER, 1, *x, rule=RULE), (0.3, 0.1, 2.0)),
    "pdf": (lambda *x: fj.pdf(FIBER, *x, lobes=(0, 1), rule=RULE), (0.3, 0.1, 2.0)),
    "pdf_smooth": (lambda *x: fj.pdf_smooth(FIBER, *x), (0.3, 0.1, 2.0)),
    "albedo": (lambda t: fj.albedo(FIBER, t), (0.3,)),
    "sample": (lambda t, u: fj.sample(FIBER, t, u)[:2], (0.3, U5)),
    "to_angles": (fj.to_angles, (WI, WO, TANGENT)),
    "from_angles": (fj.from_angles, (0.3, 0.1, 2.0, TANGENT)),
}
RULES = {"GaussH", "GaussGamma", "Series", "Windowed", "auto"}
OTHERS = {"Fiber", "Sample", "Caustics", "Roots", "Table", "check"} | RULES
OTHERS |= {"in_blocks", "tabulate"}  # of any function


def arrays(point, dtype):
    return tuple(jnp.asarray(x, dtype) for x in point)


def flat(f):
    """f with its results concatenated, so that derivatives are plain arrays."""
    return lambda *x: jnp.concatenate([jnp.ravel(y) for y in jax.tree.leaves(f(*x))])


def test_every_public_name_is_covered():
    public = {name for name in vars(fj) if not name.startswith("_")}
    modules = {name for name in public if inspect.ismodule(getattr(fj, name))}
    assert public - modules == set(CASES) | OTHERS


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_dtype_of_the_inputs_is_kept(name, dtype):
    f, point = CASES[name]
    for result in jax.tree.leaves(f(*arrays(point, dtype))):
        assert result.dtype == dtype
    if name == "sample":
        theta_i, u = arrays(point, dtype)
        draw = fj.sample(FIBER, theta_i, u, clamp=np.float64(2))
        assert draw.weight.dtype == dtype
        assert draw.p.dtype == jnp.asarray(0).dtype
    # The angles decide: a float64 constant beside them does not promote.
    if name == "N":
        angles = arrays(point[:2], dtype)
        rest = tuple(np.asarray(x, np.float64) for x in point[2:])
        assert f(*angles, *rest).dtype == dtype


@pytest.mark.parametrize("name", CASES)
def test_jit_and_vmap_agree_with_the_plain_call(name):
    f, point = CASES[name]
    point = arrays(point, jnp.float64)
    expected = flat(f)(*point)
    np.testing.assert_allclose(jax.jit(flat(f))(*point), expected, rtol=1e-12)
    batch = tuple(jnp.stack([x, x * 0.9]) for x in point)
    each = jnp.stack([flat(f)(*(x[k] for x in batch)) for k in range(2)])
    np.testing.assert_allclose(jax.vmap(flat(f))(*batch), each, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_of_first_and_second_order(name):
    """Forward against reverse, both against differences, and one in the other."""
    f, point = CASES[name]
    point = arrays(point, jnp.float64)
    size = [x.size for x in point]
    ends = np.cumsum(size)[:-1]
    x0 = jnp.concatenate([jnp.ravel(x) for x in point])

    def g(x):
        parts = jnp.split(x, ends)
        return flat(f)(*(y.reshape(z.shape) for y, z in zip(parts, point, strict=True)))

    # Second derivatives of the sum of all results, along a direction that mixes all.
    along = jnp.cos(jnp.arange(1.0, x0.size + 1))

    @jax.jit
    def every(x):
        """Value, forward and reverse derivative, and that of the reverse one."""
        reverse, second = jax.jvp(jax.jacrev(g), (x,), (along,))
        return g(x), jax.jacfwd(g)(x), reverse, second.sum(0)

    _, jacobian, reverse, second = every(x0)
    scale = 1e-3 + np.abs(jacobian)
    np.testing.assert_allclose(reverse / scale, jacobian / scale, atol=1e-10)
    step = 1e-5
    shifts = step * jnp.eye(x0.size)
    central = [(every(x0 + s)[0] - every(x0 - s)[0]) / (2 * step) for s in shifts]
    np.testing.assert_allclose(jnp.stack(central, -1), jacobian, rtol=1e-6, atol=1e-7)
    ahead, behind = (every(x0 + s * along)[2].sum(0) for s in (step, -step))
    central = (ahead - behind) / (2 * step)
    np.testing.assert_allclose(central, second, rtol=1e-5, atol=1e-6)


def test_gradient_in_every_field_of_the_fiber():
    both = jax.jit(jax.value_and_grad(lambda f: fj.evaluate(f, 0.3, 0.1, 2.0)[0]))
    _, gradient = both(FIBER)
    for k, leaf in enumerate(jax.tree.leaves(FIBER)):
        for i in np.ndindex(leaf.shape):
            step = 1e-5

            def moved(sign, k=k, i=i, step=step):
                leaves, tree = jax.tree.flatten(FIBER)
                leaves[k] = leaves[k].at[i].add(sign * step)
                return both(jax.tree.unflatten(tree, leaves))[0]

            expected = (moved(1) - moved(-1)) / (2 * step)
            found = jax.tree.leaves(gradient)[k][i]
            np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


def test_broadcasting_and_colors():
    theta_o = jnp.linspace(-1, 1, 4)[:, None]
    phi = jnp.linspace(0, 3, 5)
    rule: Any = {"rule": RULE}
    assert fj.evaluate(FIBER, 0.1, theta_o, phi, **rule).shape == (4, 5, 2)
    for sigma_a in (0.5, None):
        gray = fj.Fiber(sigma_a=sigma_a)
        assert fj.evaluate(gray, 0.1, theta_o, phi, **rule).shape == (4, 5)
    assert fj.pdf(FIBER, 0.1, theta_o, phi, **rule).shape == (4, 5)
    assert fj.albedo(FIBER, phi / 4, per_lobe=True).shape == (4, 5, 2)
    assert fj.sample(FIBER, theta_o, jnp.full((5, 5), 0.3)).weight.shape == (4, 5, 2)
    sigma_a = jnp.asarray((0.0, 0.3, 2.0))
    values = fj.N(1, phi, theta_o, eta=1.55, sigma_a=sigma_a, beta_n=0.3)
    assert values.shape == (4, 5, 3)
    one = fj.N(1, phi, theta_o, eta=1.55, sigma_a=0.3, beta_n=0.3)
    # Other colors may move the nodes: equal to rounding, relative to the peak.
    atol = 1e-14 * float(one.max())
    np.testing.assert_allclose(values[..., 1], one, rtol=0, atol=atol)
    many = jnp.asarray((0.2, 0.3))[:, None, None]
    for detector in ("normal", "logistic"):
        choices = {"sigma_a": 0.3, "detector": detector, **rule}
        found = fj.N(1, phi, 0.1, eta=1.55, beta_n=many, **choices)
        expected = [
            fj.N(1, phi, 0.1, eta=1.55, beta_n=b, **choices) for b in (0.2, 0.3)
        ]
        assert found.shape == (2, 1, 5)
        np.testing.assert_allclose(found[:, 0], expected, rtol=1e-13)


def test_lists_are_arrays():
    np.testing.assert_array_equal(
        untyped.M([0.1, 0.2], 0.1, 0.3), fj.M(np.array([0.1, 0.2]), 0.1, 0.3)
    )
    assert untyped.to_angles([1, 0, 0], [0, 1, 0], [0, 0, 1])[2] == np.pi / 2


def test_a_batch_of_fibers_by_vmap():
    betas = jnp.asarray((0.2, 0.4))
    fibers = jax.vmap(lambda b: fj.Fiber(beta_m=b, beta_n=b))(betas)
    # With R and the rest alone all that the default rule chooses from is compiled soon.
    value = jax.jit(lambda f: fj.evaluate(f, 0.3, 0.1, 2.0, lobes=(0,)))
    found = jax.vmap(value)(fibers)
    for b, each in zip(betas, found, strict=True):
        expected = value(fj.Fiber(beta_m=b, beta_n=b))
        np.testing.assert_allclose(each, expected, rtol=1e-12)


N_ARGUMENTS = {"eta": 1.55, "sigma_a": 0.1, "beta_n": 0.3}
BAD = {
    "p negative": (
        lambda: untyped.N(-1, 0.1, 0.1, **N_ARGUMENTS),
        "p = -1: must be >= 0",
    ),
    "p not an integer": (
        lambda: untyped.Phi(1.5, 0.1, 1.6),
        "must be a static integer",
    ),
    "tail from 0": (lambda: untyped.A_rest(0, 0.1, 0.5), "p = 0: must be >= 1"),
    "order": (lambda: untyped.GaussGamma(0), "order = 0: must be >= 1"),
    "rule": (
        lambda: untyped.N(1, 0.1, 0.1, rule="simpson", **N_ARGUMENTS),
        "GaussGamma",
    ),
    "rule of evaluate": (lambda: untyped.evaluate(FIBER, 0, 0, 0, rule=70), "GaussH"),
    "detector": (
        lambda: untyped.N(1, 0.1, 0.1, detector="box", **N_ARGUMENTS),
        r"detector = 'box': must be one of \('normal', 'logistic'\)",
    ),
    "incidence": (lambda: untyped.albedo(FIBER, 0.1, incidence="h"), "theta_i"),
    "no lobes": (lambda: untyped.evaluate(FIBER, 0, 0, 0, lobes=()), "at least one"),
    "lobe twice": (lambda: untyped.evaluate(FIBER, 0, 0, 0, lobes=(1, 1)), "twice"),
    "sigma_a": (
        lambda: untyped.N(1, 0.1, 0.1, eta=1.5, sigma_a=np.ones((2, 3)), beta_n=0.3),
        r"sigma_a has shape \(2, 3\): must be \(\) or \(C,\)",
    ),
    "many fibers": (
        lambda: untyped.evaluate(fj.Fiber(eta=np.ones(3) * 1.5), 0, 0, 0),
        r"eta has shape \(3,\): .*jax.vmap",
    ),
    "u of sample": (
        lambda: untyped.sample(FIBER, 0.1, np.zeros(4)),
        r"u has shape \(4,\)",
    ),
    "u of sample_M": (lambda: untyped.sample_M(0.1, 0.1, np.zeros(3)), "must end in 2"),
    "clamp": (lambda: untyped.sample(FIBER, 0.1, np.ones(5) / 2, clamp=0), "clamp = 0"),
    "gradient": (
        lambda: untyped.sample(FIBER, 0.1, np.ones(5) / 2, gradient="none"),
        "detached",
    ),
    "negative clamp": (
        lambda: untyped.sample(FIBER, 0.1, np.ones(5) / 2, clamp=np.float32(-2)),
        "must be > 0",
    ),
    "rest": (lambda: untyped.evaluate(FIBER, 0, 0, 0, rest="no"), "True or False"),
    "per_lobe": (lambda: untyped.albedo(FIBER, 0, per_lobe=2), "per_lobe = 2"),
    "p of lobe": (lambda: untyped.lobe(FIBER, -1, 0, 0, 0), "p = -1"),
    "no eta": (lambda: untyped.evaluate(fj.Fiber(eta=None), 0, 0, 0), "eta is None"),
    "no widths": (
        lambda: untyped.evaluate(fj.Fiber(widths_m=()), 0, 0, 0),
        r"widths_m has shape \(0,\)",
    ),
    "smooth TRT": (
        lambda: untyped.pdf_smooth(FIBER, 0, 0, 0, lobes=(0, 2)),
        "lobes = ",
    ),
    "vector": (
        lambda: untyped.to_angles(np.ones(2), WO, TANGENT),
        r"wi has shape \(2,\)",
    ),
    "tangent": (
        lambda: untyped.from_angles(0.0, 0.0, 0.0, np.ones(2)),
        "tangent has shape",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_what_is_allowed(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()


FLOORS = (
    {"_types", "counting", "expression", "orders", "ranges"},
    {"bulk", "numerics", "programs", "quadrature", "table"},
    {"bessel", "chunks", "circular", "fresnel", "perceptual", "pigment"},
    {"baking", "spherical"},
    {"along", "compat", "detectors"},
    {"path"},
    {"section"},
    {"crossings"},
    {"rules", "roots"},
    {"cases"},
    {"graded", "textbook"},
    {"series", "windows"},
    {"auto"},
    {"azimuthal"},
    {"fiber"},
    {"model", "parameters"},
    {"selection", "tabled"},
    {"energy", "farfield", "frame", "kajiya_kay", "lambert", "sampling", "smooth"},
    {"scenes"},
    {"entering", "planned", "probes"},
    {"measured"},
    {"asking", "formulas"},
    {"truncation"},
    {"choices", "sharing"},
    {"expenses"},
    {"plans"},
    {"planning"},
    {"scene"},
    {"nearfield"},
    {"approximation", "deon2014", "directions", "marschner"},
    {"fitting", "shading"},
    {"absorption"},
    {"exponential", "karis", "tail"},
    {"artist", "heads", "realtime"},
    {"engines", "farfields", "mitsuba3", "nodes", "pathtracers", "principled", "rtx"},
    {"unreal"},
    {"convert"},
    {"languages", "regrouping", "tracing"},
    {"statements"},
    {"emission"},
    {"shader"},
)


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            package, _, module = node.module.partition(".")
            if package == "fiberjax":
                found |= {module} if module else {alias.name for alias in node.names}
    return found


def test_a_file_imports_only_from_lower_floors():
    source = Path(fj.__file__).parent
    floor_of = {name: k for k, names in enumerate(FLOORS) for name in names}
    files = {path.stem: path for path in source.glob("*.py")}
    assert set(files) - {"__init__"} == set(floor_of)
    for name, floor in floor_of.items():
        for module in imports(source / f"{name}.py"):
            assert floor_of[module] < floor, f"{name} imports {module}"


def test_the_library_leaves_the_configuration_alone():
    for path in Path(fj.__file__).parent.glob("*.py"):
        assert "jax.config" not in path.read_text()


def test_float32_is_enough(tmp_path):
    """With x64 off, as users have it, nothing warns and nothing needs float64."""
    script = tmp_path / "float32.py"
    script.write_text(
        "import warnings; warnings.simplefilter('error')\n"
        "import numpy as np, fiberjax as fj\n"
        "hair = fj.Fiber(alpha=np.float64(-0.03))\n"
        "S = fj.evaluate(hair, np.float64(0.3), 0.1, 2.0)\n"
        "draw = fj.sample(fj.Fiber(), 0.3, np.full(5, 0.4))\n"
        "assert S.dtype == draw.weight.dtype == np.float32\n"
        "print(*S)\n"
    )
    run = [sys.executable, str(script)]
    text = subprocess.run(run, check=True, capture_output=True, text=True).stdout
    exact = fj.evaluate(fj.Fiber(alpha=-0.03), 0.3, 0.1, 2.0)
    np.testing.assert_allclose([float(x) for x in text.split()], exact, rtol=1e-5)
