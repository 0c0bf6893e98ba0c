"""Many queries over meshes: numbers, communication, memory and processes."""

import re
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import many_devices
import numpy as np
import pytest

import fiberjax as fj

SCRIPT = Path(__file__).with_name("many_devices.py")
LIMIT = 600
HAIR = many_devices.hair()
untyped: Any = fj


def run(tmp_path, plan, name, devices, processes):
    """The arrays that the script writes, computed by this many processes."""
    output = tmp_path / f"{name}.npz"
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    started = []
    try:
        for k in range(processes):
            command = [sys.executable, str(SCRIPT), str(output), str(plan)]
            command += ["--devices", str(devices)]
            if processes > 1:
                command += ["--process", str(port), str(processes), str(k)]
            pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            started.append(subprocess.Popen(command, text=True, **pipes))
        for one in started:
            _, errors = one.communicate(timeout=LIMIT)
            assert one.returncode == 0, errors
    finally:
        for one in started:
            one.kill()
            one.wait()
    with np.load(output) as file:
        return dict(file)


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    found = fj.scene.plan(many_devices.scene())
    assert "table" in str(found)
    found.save(path)
    return path


@pytest.fixture(scope="module")
def single(tmp_path_factory, plan):
    return run(tmp_path_factory.mktemp("single"), plan, "single", 1, 1)


@pytest.mark.parametrize(("devices", "processes"), [(8, 1), (2, 2)])
def test_a_mesh_changes_no_number(single, plan, devices, processes, tmp_path):
    many = run(tmp_path, plan, "many", devices, processes)
    assert many.pop("devices") == devices * processes
    assert set(many) | {"devices"} == set(single)
    for name, x in many.items():
        ulp = np.finfo(x.dtype).eps * np.abs(single[name]).max()
        np.testing.assert_allclose(x, single[name], rtol=0, atol=8 * ulp, err_msg=name)


def test_one_device_is_the_function_itself(single):
    f, at = many_devices.FULL, many_devices.angles(4096)
    expected = f(HAIR, *at)
    np.testing.assert_allclose(single["values"], expected, rtol=1e-13, atol=1e-300)
    slope = jax.grad(lambda fiber: (f(fiber, *at) ** 2).mean())(HAIR)
    for k, leaf in enumerate(jax.tree.leaves(slope)):
        scale = float(jnp.abs(leaf).max())
        found = single[f"gradient {k}"]
        np.testing.assert_allclose(found, leaf, rtol=0, atol=1e-13 * scale)


def test_one_device_keeps_the_promise_of_a_plan(single):
    full = fj.evaluate(HAIR, *many_devices.angles(4096))
    error = np.abs(single["planned"] - full).max()
    assert 0 < error < many_devices.scene().tolerance * full.max()


def test_the_furnace_finds_the_albedo(single):
    weights = single["furnace"]
    error = weights.std(0, ddof=1) / np.sqrt(len(weights))
    exact = fj.albedo(HAIR, many_devices.THETA_I, **many_devices.CHOICES)
    assert (np.abs(weights.mean(0) - exact) < 4.5 * error).all()
    assert (error < 0.01 * np.asarray(exact)).all()


def test_a_kept_bake_is_the_same(single):
    for name in ("table", "float32 table"):
        np.testing.assert_array_equal(single[name], single[f"{name} again"])


COLLECTIVES = """
import re, sys
import jax
import numpy as np
jax.config.update("jax_num_cpu_devices", 8)
sys.path.insert(0, sys.argv[1])
import many_devices
import fiberjax as fj

mesh = jax.make_mesh((2, 4), ("hosts", "devices"))
along = jax.NamedSharding(mesh, jax.P(("hosts", "devices")))
at = [jax.device_put(np.float32(x), along) for x in many_devices.angles(4096)]
bulk = fj.in_blocks(many_devices.FULL, mesh=mesh, block=many_devices.BLOCK)
loss = jax.jit(jax.grad(lambda fiber, *at: (bulk(fiber, *at) ** 2).sum()))
for name, g in (("value", bulk), ("gradient", loss)):
    for line in g.lower(many_devices.hair(), *at).compile().as_text().splitlines():
        kind = r"(all-\\w+|collective-\\w+|reduce-scatter)"
        found = re.search(rf"= (.*?) {kind}(-start)?\\(", line)
        if found:
            print(name, found[2], re.sub(r"/\\*.*?\\*/|\\{\\d*\\}", "", found[1]))
"""


def test_only_the_gradient_in_the_parameters_is_sent():
    """The compiled program: nothing for values, some scalars for the gradient."""
    command = [sys.executable, "-c", COLLECTIVES, str(SCRIPT.parent)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines
    for line in lines:
        name, kind, shapes = line.split(" ", 2)
        assert (name, kind) == ("gradient", "all-reduce")
        sizes = [
            np.prod([int(n) for n in dims.split(",") if n])
            for dims in re.findall(r"\[([\d,]*)\]", shapes)
        ]
        assert 0 < sum(sizes) <= sum(x.size for x in jax.tree.leaves(HAIR))


def temporary(f, *given):
    """Bytes that a compiled function needs beside arguments and results."""
    compiled: Any = jax.jit(f).lower(*given).compile()
    return compiled.memory_analysis().temp_size_in_bytes


def test_memory_is_that_of_a_block():
    """And in reverse mode that of the cotangents of results, three numbers a query."""

    def R(fiber, *at):
        return fj.lobe(fiber, 0, *at, rule=fj.GaussGamma(16))

    def needed(blocks, block):
        x = jax.ShapeDtypeStruct((blocks * block,), jnp.float64)
        bulk = fj.in_blocks(R, block=block)
        slope = jax.grad(lambda fiber, *at: bulk(fiber, *at).sum())
        cotangents = 3 * 8 * x.size
        given = HAIR, x, x, x
        return temporary(bulk, *given), temporary(slope, *given) - cotangents

    few, many, one = needed(4, 1024), needed(1024, 1024), needed(1, 64 * 1024)
    for k in range(2):
        assert many[k] < 1.2 * few[k] + 8192
        assert many[k] < one[k] / 8


def test_what_is_drawn_in_a_block_is_never_stored():
    """The gradient of a sum over any number of queries, in the memory of one block."""

    def total(width, seed):
        x = jax.random.normal(jax.random.key(seed[0]), (4096,))
        return jnp.exp(-((x / width) ** 2)).sum()[None]

    bulk = fj.in_blocks(total, block=1)
    slope = jax.grad(lambda width, seeds: bulk(width, seeds).sum())
    few, many = (
        temporary(slope, 1.0, jax.ShapeDtypeStruct((n,), jnp.int64)) for n in (4, 4096)
    )
    per_seed = 16
    assert many < few + per_seed * 4096 + 8192 < 4096 * 4096


def test_numbers_and_trees_go_through():
    def f(scale, x, y, u):
        return {"sum": scale * (x + y), "u": u.sum(-1)}

    x, u = jnp.arange(7.0), jnp.ones((7, 5))
    found = fj.in_blocks(f, block=3)(2.0, x, 1.5, u)
    np.testing.assert_array_equal(found["sum"], 2 * (x + 1.5))
    np.testing.assert_array_equal(found["u"], 5 * np.ones(7))
    assert fj.in_blocks(f)(np.float32(2), jnp.float32(x), 1.5, u)["sum"].dtype == "f4"


BAD = {
    "block": (lambda: fj.in_blocks(fj.M, block=0), "block = 0: must be >= 1"),
    "lengths": (
        lambda: fj.in_blocks(fj.evaluate)(HAIR, np.ones(3), np.ones(4), 0.1),
        r"\(3,\), \(4,\), \(\).*the same first axis",
    ),
    "no queries": (lambda: fj.in_blocks(fj.evaluate)(HAIR, 0.1, 0.2), "first axis"),
    "result": (
        lambda: fj.in_blocks(lambda _, x: x.sum())(None, np.ones(3)),
        r"returns shape \(\) for 3 queries",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_says_what_is_allowed(case):
    call, message = BAD[case]
    with pytest.raises(ValueError, match=message):
        call()
