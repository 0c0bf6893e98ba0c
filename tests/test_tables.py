"""The accuracy contract: every equation, in both dtypes, against exact values.

The tables come from `make_tables.py`; `BUDGET` says how large an error may be.
"""

import functools
import itertools
import json
import math
from collections import defaultdict
from collections.abc import Callable
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from reference import mp, mpf

import fiberjax

TABLES = Path(__file__).parent / "tables"
TRUTH = TABLES.parent.parent.parent / "shared" / "truth"
DTYPES = ("float64", "float32")
STATIC = ("p", "detector")
NARROW = 0.1


class Budget(NamedTuple):
    """Errors allowed, in units of eps, for a function f of arguments x.

    value:     ulps[0] (|f| + sum_k rounds_k |f_k|)
    gradient:  ulps[1] (|f_j| + size/scale_j + sum_k rounds_k |f_jk|)
    Hessian:   ulps[2] (|f_ij| + size/(scale_i scale_j))
                       (1 + sum_k rounds_k (1/scale_k + |f_k/f|))

    A derivative is a sum whose terms are of order size/scale, where size is |f| and
    scale how far an argument goes before f is another function: that is what bounds
    its error where the terms cancel. `rounds` is for arguments that have to be rounded
    on the way, such as an angle to be wrapped.
    """

    ulps: tuple[float, ...]
    scale: Callable
    rounds: Callable = lambda *x: np.zeros(len(x))
    size: Callable = lambda f, *x: abs(f)


TINY = 1e-30


def segment_scales(h, theta_d, eta, sigma_a):
    # The length depends on h through k - c^2 h^2, on the rest through k.
    c = math.cos(theta_d)
    k = (eta - 1) * (eta + 1) + c * c
    return min(1, k / c**2 - h * h), math.sqrt(k), min(eta, k), sigma_a


def segment_size(f, h, theta_d, eta, sigma_a):
    c = math.cos(theta_d)
    k = (eta - 1) * (eta + 1) + c * c
    return f * max(sigma_a, TINY) * 2 * eta * math.sqrt(k - (c * h) ** 2) / k


def sample_M_scales(theta_cone, v, xi, u1):
    # v enters through the angle off the cone's direction, of cosine 1 - w.
    w = min(-v * math.log1p(xi * math.expm1(-2 / v)), 2)
    return 1, v * math.sqrt((2 - w) / w), xi * (1 - xi), 1


def steps(x, width):
    """How many widths off its center a detector is seen, or 1."""
    return max(1, abs(math.remainder(x, 2 * math.pi)) / width)


BUDGET = {
    "reflectance": Budget(
        (4, 16, 32),
        lambda mu, eta: (min(1, math.sqrt(eta * eta - 1 + mu * mu)), eta - 1),
    ),
    "eta_prime": Budget((2, 4, 8), lambda theta, eta: (abs(math.cos(theta)), eta)),
    "Phi": Budget(
        (2, 4, 16),
        lambda h, eta_p: (1 - h * h, 1),
        size=lambda f, h, eta_p: math.sqrt(1 - h * h),
    ),
    "transmittance": Budget(
        (2, 4, 8),
        segment_scales,
        lambda h, theta, eta, sigma: (0, 0, 0, sigma),
        segment_size,
    ),
    "A": Budget((4, 8, 16), lambda F, T: (1 - F, 1)),
    "A_rest": Budget((4, 8, 16), lambda F, T: (1 - F * T, 1 - F * T)),
    # The Hessian of a draw is of no use.
    "sample_M": Budget(
        (2, 4),
        sample_M_scales,
        lambda theta, v, xi, u: (abs(theta), v, xi, u),
        lambda f, *x: 1,
    ),
    "wrapped_normal": Budget(
        (2, 2, 2),
        lambda x, b: (b / steps(x, b), b / steps(x, b) ** 2),
        lambda x, b: (abs(x), b),
    ),
    "trimmed_logistic": Budget(
        (2, 2, 4),
        lambda x, s: (s, s / steps(x, s)),
        lambda x, s: (abs(x), s),
    ),
    # (4 + 2|E|) eps |f|; for derivatives also 4, and 8, sum |terms| eps
    "M": (4, 2, 4, 8),
    # of the peak: max(1e-13, 4 eps pi/min(beta_n, 1) + 2 p sigma_a eps)
    "N": (1e-13, 4),
    "N_narrow": (1e-13, 4),
    "N_logistic": (1e-13, 4),
    "N_logistic_narrow": (1e-13, 4),
    # of the sizes that stand in the table
    "S": 1,
}


def smooth_errors(budget, f, arguments, point):
    """Allowed errors of value, gradient and Hessian by a `Budget`, in units of eps."""
    x = np.array([float(point["in"][name]) for name in arguments])
    scales = (max(length, TINY) for length in budget.scale(*x))
    scale = dict(zip(arguments, scales, strict=True))
    rounds = dict(zip(arguments, budget.rounds(*x), strict=True))
    size = budget.size(abs(f[""]), *x)

    def moved(*names):
        keys = {k: ",".join(sorted((*names, k), key=arguments.index)) for k in scale}
        return sum(rounds[k] * abs(f.get(keys[k], 0)) for k in scale)

    condition = moved() / abs(f[""]) if f[""] else 0
    spread = 1 + condition + sum(rounds[k] / scale[k] for k in scale)
    for key, exact in f.items():
        names = key.split(",") if key else []
        terms = size / math.prod(scale[k] for k in names) if names else 0
        if len(names) < 2:
            allowed = abs(exact) + terms + moved(*names)
        else:
            allowed = (abs(exact) + terms) * spread
        if len(names) < len(budget.ulps):
            yield key, budget.ulps[len(names)] * allowed


def M_errors(budget, f, arguments, point):
    """Allowed errors of M and its derivatives, in units of eps."""
    base, slope, first, second = budget
    sizes = bracket_sizes(*(point["in"][name] for name in arguments))
    relative = base + slope * abs(float(point["E"]))
    for key, exact in f.items():
        terms = 0.0
        names = key.split(",") if key else []
        if len(names) == 1:
            terms = first * sizes[key]
        elif names:
            terms = second * (sizes[key] + sizes[names[0]] * sizes[names[1]])
        yield key, relative * abs(exact) + terms * abs(f[""])


def bracket_sizes(*arguments):
    with mp.workdps(30):
        sizes = reference.bracket_sizes(*(mpf(float(x)) for x in arguments))
        return {key: float(size) for key, size in sizes.items()}


def N_errors(budget, point, eps):
    """Allowed errors of N and its gradient."""
    tolerance, floor = budget
    s = float(point["in"]["beta_n"])
    p, sigma_a = point["in"]["p"], float(point["in"]["sigma_a"])
    # The exponent of the absorption, up to 2 p sigma_a, is rounded like the angles.
    rounding = floor * eps * math.pi / min(s, 1) + 2 * p * sigma_a * eps
    smallest = 1e-290 if eps < 1e-10 else 1e-30
    peaks = {key: float(peak) for key, peak in point["peak"].items()}
    for key, peak in peaks.items():
        # A derivative that nearly cancels is a difference of terms as large as N, those
        # of a detector in its argument and its width as large as N/beta_n.
        terms = peaks["value"] / (min(s, 1) if key in ("phi", "beta_n") else 1)
        size = max(peak, terms)
        yield "" if key == "value" else key, max(tolerance, rounding) * size + smallest


def sample_M(theta_cone, v, xi, u1):
    # The table holds the number after its move to the center of its cell.
    u0 = xi - jnp.finfo(xi.dtype).eps / 2
    return fiberjax.sample_M(theta_cone, v, jnp.stack([u0, u1]))


def S(theta_i, theta_o, phi, h, eta, beta_m, beta_n, alpha, sigma_a):
    of = fiberjax.Fiber(eta, beta_m, beta_n, alpha, sigma_a)
    return fiberjax.nearfield.evaluate(of, theta_i, theta_o, phi, h)


RULES = {True: fiberjax.Windowed(56), False: fiberjax.GaussGamma(192)}
"""Rules with nodes to spare, by whether a detector is narrow."""


def N(phi, theta_d, eta, sigma_a, beta_n, *, p, detector, narrow):
    return fiberjax.N(
        p,
        phi,
        theta_d,
        eta=eta,
        sigma_a=sigma_a,
        beta_n=beta_n,
        detector=detector,
        rule=RULES[narrow],
    )


def equation(name, static):
    """The function of the real arguments."""
    if name.startswith("N"):
        return lambda *x: N(*x, **static)
    if name in ("sample_M", "S"):
        return {"sample_M": sample_M, "S": S}[name]
    f = getattr(fiberjax, name)
    return (lambda *x: f(static["p"], *x)) if static else f


def derivatives(f, arguments, order):
    """A function from arrays to {"": value, "x": derivative, "x,y": ...}."""
    every = tuple(range(len(arguments)))

    def jet(*x):
        value, slopes = jax.value_and_grad(f, every)(*x)
        found = {"": value} | dict(zip(arguments, slopes, strict=True))
        if order == 2:
            rows = jax.hessian(f, every)(*x)
            pairs = itertools.combinations_with_replacement(every, 2)
            found |= {f"{arguments[i]},{arguments[j]}": rows[i][j] for i, j in pairs}
        return found

    return jax.jit(jax.vmap(jet))


def evaluated(name, points, dtype):
    """Pairs of a point and what the library finds there, by keys."""
    groups = defaultdict(list)
    for point in points:
        static = {n: point["in"][n] for n in STATIC if n in point["in"]}
        if name.startswith("N"):
            static["narrow"] = float(point["in"]["beta_n"]) < NARROW
        groups[tuple(static.items())].append(point)
    for static, members in groups.items():
        arguments = [n for n in members[0]["in"] if n not in STATIC]
        x = [jnp.array([float(q["in"][n]) for q in members], dtype) for n in arguments]
        order = 1 if name.startswith(("N", "S")) else 2
        found = derivatives(equation(name, dict(static)), arguments, order)(*x)
        assert {array.dtype for array in found.values()} == {jnp.dtype(dtype)}
        columns = {key: np.asarray(array, float) for key, array in found.items()}
        for i, point in enumerate(members):
            yield point, {key: column[i] for key, column in columns.items()}


def exact_values(point):
    values = {"": point["value"], **point["grad"], **point.get("hess", {})}
    return {key: float(text) for key, text in values.items()}


def allowed_errors(name, f, point, dtype):
    info = np.finfo(dtype)
    if "size" in point:
        for key, size in point["size"].items():
            room = BUDGET[name] * float(info.eps) * float(size)
            yield key, room + float(info.smallest_normal)
        return
    if "peak" in point:
        yield from N_errors(BUDGET[name], point, float(info.eps))
        return
    arguments = [n for n in point["in"] if n not in STATIC]
    errors = M_errors if name == "M" else smooth_errors
    for key, error in errors(BUDGET[name], f, arguments, point):
        # A point's "second" names the only dtype with room for second derivatives.
        if "," not in key or point.get("second", dtype) == dtype:
            yield key, float(info.eps) * error + float(info.smallest_normal)


def budgets_spent(name, results, dtype):
    """Every error over what is allowed, with the words to describe it."""
    for point, found in results:
        f = exact_values(point)
        for key, allowed in allowed_errors(name, f, point, dtype):
            if key not in f:
                continue
            error = abs(found[key] - f[key])
            if underflows(point, dtype) and error <= abs(f[key]):
                continue
            words = f"d/d[{key}] {found[key]}, not {f[key]}, at {point['in']}"
            yield error / allowed, words


def underflows(point, dtype):
    """Whether the exponential in the function is no normal number: 0 is then right."""
    smallest = math.log(np.finfo(dtype).smallest_normal)
    return float(point.get("E", 0)) < smallest


def check(name, results, dtype):
    spent = list(budgets_spent(name, results, dtype))
    assert len(spent) >= len(results)
    beyond = [
        f"{times:.3g} budgets: {words}" for times, words in spent if not times <= 1
    ]
    assert not beyond, "\n".join([f"{len(beyond)} of {len(spent)}", *beyond[:20]])


# What takes longest to compile waits for the slow run.
LATER = [("N_narrow", "float32"), *(("N_logistic_narrow", dtype) for dtype in DTYPES)]
SOON = [(name, dtype) for name in BUDGET for dtype in DTYPES]
SOON = [case for case in SOON if case not in LATER]


@pytest.mark.parametrize(("name", "dtype"), SOON)
def test_table(name, dtype):
    check_table(name, dtype)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "dtype"), LATER)
def test_narrow_table(name, dtype):
    check_table(name, dtype)


def check_table(name, dtype):
    points = json.loads((TABLES / f"{name}.json").read_text())["points"]
    points = [q for q in points if q.get("only", dtype) == dtype]
    check(name, list(evaluated(name, points, dtype)), dtype)


def shared_points(name):
    path = TRUTH / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return json.loads(path.read_text())["points"]


@pytest.mark.parametrize("dtype", DTYPES)
def test_shared_longitudinal(dtype):
    points = []
    for row in shared_points("longitudinal.json"):
        given = {"theta_cone": "theta_c", "theta_o": "theta_o", "v": "v"}
        theta_c, theta_o, v = (float(row[key]) for key in given.values())
        points.append(
            {
                "in": {name: row[key] for name, key in given.items()},
                "value": row["M"],
                "grad": {name: row[f"dM_d{key}"] for name, key in given.items()},
                "E": -2 * math.sin((theta_o - theta_c) / 2) ** 2 / v,
            }
        )
    check("M", list(evaluated("M", points, dtype)), dtype)


@pytest.mark.slow
def test_azimuthal():
    """The tightest rule in float64: relative errors beyond the rounding floor.

    That of an angle near pi, 4 pi eps/s, is set aside in N and in v dN/dv, which
    cancels. The points are rigorous enclosures in interval arithmetic; their numbers
    are no float32 numbers.
    """
    names = ("phi", "theta_d", "eta", "sigma_a", "v")

    def jet(p, x):
        def N(phi, theta_d, eta, sigma_a, v):
            optics = {"eta": eta, "sigma_a": sigma_a, "beta_n": jnp.sqrt(v)}
            return fiberjax.N(p, phi, theta_d, rule=fiberjax.auto(1e-16), **optics)

        return jax.value_and_grad(N, range(5))(*x)

    values, slopes = [], {name: [] for name in names}
    points = json.loads((TABLES / "azimuthal.json").read_text())["points"]
    rows = sorted(points, key=itemgetter("p"))
    for p, group in itertools.groupby(rows, key=itemgetter("p")):
        group = list(group)
        x = jnp.array([[float(row[name]) for name in names] for row in group])
        found, slope = jax.lax.map(functools.partial(jet, p), x)
        for k, row in enumerate(group):
            v, exact = float(row["v"]), float(row["N"])
            if exact < 1e-290:
                assert 0 <= found[k] < 1e-290
                continue
            floor = 4 * math.pi * np.finfo(float).eps / math.sqrt(v)
            values.append(max(abs(float(found[k]) / exact - 1) - floor, 0))
            for name, each in zip(names, slope, strict=True):
                if "dN" in row:
                    right = abs(float(row["dN"][name]))
                    off = abs(float(each[k]) - float(row["dN"][name]))
                    off = max(off - floor * exact / v * (name == "v"), 0)
                    slopes[name].append(off / right if off > 0 else 0)
    assert len(values) > 100
    assert np.median(values) < 1e-13
    assert np.percentile(values, 99) < 3e-11
    for name, errors in slopes.items():
        assert np.median(errors) < 1e-11, name
        assert np.percentile(errors, 90) < 1e-8, name
